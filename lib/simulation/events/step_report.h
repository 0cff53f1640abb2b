// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a step, or of an island of it: what came of it and what it counts, with the sums
// over a run.

#include <string>

#include "tangible/lcp/contact/contact_solver.h"

namespace tangible {

/// How often stepping had to relax its own rules.
struct EventFallbacks {
  /// Accelerations that do not exist (Painlevé) and are replaced by impulses of a very short step.
  long short_steps = 0;
  /// Pairs beyond max_events_per_step in a step, whose further impacts in it are inelastic; of
  /// fixed steps sets of bodies whose rebounds walls do not allow.
  long rebounds_given_up = 0;
  /// Impacts after which contacts are held closed because they leave so slowly that they would
  /// return at once.
  long held_contacts = 0;

  void Add(const EventFallbacks& other) {
    short_steps += other.short_steps;
    rebounds_given_up += other.rebounds_given_up;
    held_contacts += other.held_contacts;
  }
  long total() const { return short_steps + rebounds_given_up + held_contacts; }
};

struct StepCounts {
  Rung rung = Rung::kNone;  ///< by events: the last in order that any of its solves needed
  long contacts = 0;        ///< contacts and limits listed
  long lcp_rows = 0;        ///< complementarity rows: 1 for a frictionless contact or limit, else 3
  long single_rows = 0;     ///< contacts and limits that have one row in place of three
  long angles_left_out = 0;  ///< bodies that have rows, but none that turns them
  // Of the last search for contacts, or by events for events.
  long pairs_compared = 0;   ///< pairs of boxes that the broad phase compared
  long pairs_near = 0;       ///< pairs whose boxes overlap
  long beyond_reach = 0;     ///< of these, without rows: out of reach in this step (fixed stepping)
  long factorisations = 0;   ///< of a fixed step: of the island that took the most
  long iterations = 0;       ///< of a fixed step: of the island that took the most
  long events = 0;           ///< located within the step (event stepping)
  long bounces_ended = 0;    ///< by events: contacts whose ever faster rebounds were taken as over
  EventFallbacks given_up;   ///< what it gave up of its own rules
  ContactFallbacks solver;   ///< what its solves leaned on beyond the guess
  long newton_stages = 0;    ///< event stepping: implicit stages whose iteration does not contract
  long halved_motions = 0;   ///< event stepping: that could not be integrated as a whole
  long ellipse_motions = 0;  ///< event stepping: shortened where an ellipse touches
  long damped_projections = 0;  ///< steps of the joint projection that Newton's method could not do
  long mode_switches = 0;       ///< contacts whose mode differs from the last step's
  double residual = 0.0;        ///< scaled natural residual, the largest
  /// J, what the impulses of a step with impacts, or of an impact, did, the largest; > 0: energy
  /// was gained.
  double impact_energy_gain = 0.0;

  /// Adds counts; of `rung`, `residual` and `impact_energy_gain` the largest remains.
  void Add(const StepCounts& other);
};

/// Of a step or a run. kRefused: a parameter has a value that is not allowed; nothing was run.
enum class StepStatus { kDone, kUnsolved, kDiverged, kRefused };

/// "done", "unsolved", "diverged", "refused".
const char* NameOf(StepStatus status);

/// The report of a step; the caller sums over the run.
struct StepReport : StepCounts {
  StepStatus status = StepStatus::kDone;
  int closed = 0;        ///< contacts with an impulse
  int islands = 0;       ///< with contacts, or by events, solved apart; 0: all is one
  double gap_min = 0.0;  ///< m, the smallest at the start; infinite where no contact is near
  std::string message;   ///< empty unless it failed: names the contact or joint
  bool stopped = false;  ///< by events: before its end (AtEvent::kStopAtSecond)
};

}  // namespace tangible
