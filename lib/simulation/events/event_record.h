// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The record of an event step that its derivatives need: segments of smooth motion, each up to an
// event or to the step's end, and impacts between them.

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <vector>

#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

/// A linear system of accelerations or of a correction, solved with given modes.
struct SolvedNode {
  State<double> state;  ///< where it was assembled
  double time = 0.0;
  ContactProblem<double> problem;
  ContactSolution<double> solution;  ///< v holds accelerations (m/s²) or the correction (m)
  ContactSystem system;
};

/// A solved step, fixed or of impulses, with everything that its derivative needs.
struct StepRecord {
  double time = 0.0;
  double h = 0.0;
  State<double> before;
  std::vector<double> new_twist;  ///< of all bodies
  std::vector<ActiveContact> contacts;
  std::vector<CoefficientSource> friction, restitution;
  ContactProblem<double> problem;
  ContactSolution<double> solution;

  SolvedEquations View(const std::vector<int>& contact_block) const;
  /// Memory of the vectors.
  size_t bytes() const;
};

/// An instantaneous change of twists: an impact or a projection of twists, as a step with h = 0;
/// or, where accelerations have no solution, impulses of a very short step. By Poisson's law an
/// impact is two parts of the record, its compression and then its decompression.
struct Impulses : StepRecord {
  ContactSystem system;
  double inside = 0.0;          ///< the time that tells the pieces on which paths are followed
  bool decompression = false;   ///< of the impulses found by the part before
  bool remainder = false;       ///< of what rounding left of the approach of the impact before it
  std::vector<int> compressed;  ///< decompression: each contact's index in that part
  /// Behind edges of one instant, or at rest on supports: what holds has no speed, but a derivative
  /// of one until here.
  bool holds = false;
};

enum class EventKind : unsigned char {
  kStepEnd,       ///< no event: the end of the step
  kEdge,          ///< a force's window opens or closes, a joint ends, a signal or path has a corner
  kTouch,         ///< a gap or the distance from a joint limit closes
  kSlipEnds,      ///< a sliding speed reaches 0
  kSlipBegins,    ///< friction reaches its limit (Segment::SticksWith)
  kLiftOff,       ///< a normal force reaches 0
  kServoBound,    ///< a servo reaches or leaves its bound
  kSupportStops,  ///< a point on its support comes to rest, or all of them
  kSupportLetsGo,  ///< a support reaches the limit of what it can hold
  kReturn,         ///< the speed at which an open contact leaves penetration reaches 0
  kAtOnce,         ///< the same at the segment's start, where poses and twists are corrected
};

/// "touch", "end of sliding", ...
const char* NameOf(EventKind event);

/// Whether an event's time is found from an equation (and not given).
bool IsLocated(EventKind kind);

/// An end of a force's window, the end of a joint, or a knot of a path: the parameter that sets its
/// time, −1: none.
struct WindowEdge {
  int number = -1;
  int force = -1;     ///< −1: of a joint, or of a path, whose time is the knot's and the number
  double side = 0.0;  ///< −1: the window opens there, 1: it closes
  int path = -1;      ///< of a knot at which the path's rate jumps
};

/// How a contact goes as several let go together: the rates at which it opens and slides, as shares
/// of the largest.
struct ReleaseRate {
  double opens = 0.0;   ///< at least 0
  double slides = 0.0;  ///< along its tangent
};

/// Smooth motion over [time, time + length] with modes held, then the event that ended it.
struct Segment {
  double time = 0.0;
  double length = 0.0;
  /// At the start of a run: contacts that the initial twists approach act with friction.
  bool starts = false;
  double middle = 0.0;  ///< the time at which forces and pieces of signals are chosen
  /// Of a segment of zero length between edges of windows at one instant: the edges that are still
  /// to come, of which the first ends it (event_edges.h).
  std::vector<WindowEdge> further_edges;
  /// The number of the edge at its start, or of another one at its end, where the order of the two
  /// edges matters; otherwise −1.
  int edge_before = -1;
  State<double> before, after;
  std::vector<ActiveContact> contacts;  ///< those closed; law kRecovery: pushed out of penetration
  std::vector<CoefficientSource> friction;
  std::vector<ContactMode> modes;
  std::vector<SolvedNode> stages;  ///< of the integrator
  int num_stages = 0;
  std::vector<SolvedNode> corrections;  ///< of poses, one after another
  int num_corrections = 0;
  bool projects_twists = false;
  Impulses projection;

  EventKind event = EventKind::kStepEnd;
  ActiveContact event_contact;
  /// kTouch: the feature of the contact `event_lost` gives way to that of event_contact.
  bool hands_over = false;
  /// The same without a jump of the normal, at a rounded corner: the gap is closed on either side,
  /// and the event's equation is SineBetween.
  bool passes = false;
  ActiveContact event_lost;
  CoefficientSource event_friction;  ///< of kSlipBegins
  double event_sign = 0.0;  ///< sign of kSlipBegins' tangential force, of kServoBound's bound
  int event_number = -1;    ///< kEdge: the number that is the time; −1: a constant
  SolvedNode end;           ///< kSlipBegins, kLiftOff: accelerations after the motion
  int event_index = -1;     ///< the same: which of `contacts`; kServoBound: the servo;
                            ///< kSupportStops, kSupportLetsGo: the support
  /// kSupportLetsGo: what it then does, with the direction in which the body begins to move.
  SupportState event_support;
  /// kSlipBegins, kLiftOff: where rows share forces that are not determined, what the contacts do
  /// that let go together; empty: event_contact, and what sticks with it. The event's function is
  /// then the work of the held forces and of friction's limits along these rates (WorkLeft), which
  /// does not depend on the shares, and whose derivative by the rates is 0.
  std::vector<ReleaseRate> release;
  /// The event's function does not pass through 0 but jumps where poses and twists are corrected at
  /// the start of the segment: the time of the event is that start, whatever varies.
  bool at_once = false;

  /// The tangent of the time of its end, which EventDerivative::Tangent and EventStepInJets set.
  Eigen::RowVectorXd end_dot;
  /// The derivatives of losses with respect to that time, which Adjoint takes up; mostly none.
  Eigen::RowVectorXd end_bar;

  /// Whether the event's time is found from an equation.
  bool IsEventLocated() const { return IsLocated(event) && !at_once; }
  /// Whether the event's time is the segment's start.
  bool IsEventAtOnce() const { return event == EventKind::kAtOnce || at_once; }

  /// Whether the event's equation changes with the segment's length, by `rate`, and not by rounding
  /// alone. `terms`: the sum of the magnitudes of the terms of the rate.
  bool HasRate(double rate, double terms) const;
  /// Whether contact i sticks between the bodies of contact k, as k does. Such contacts, the two
  /// ends of a face, begin to slide together, when the sum of their friction reaches the sum of its
  /// limits: the share of each is not determined, and nothing moves before.
  bool SticksWith(size_t i, size_t k) const {
    return modes[i] == ContactMode::kSticking && contacts[i].IsBetweenTheSame(contacts[k]);
  }
  /// Whether a contact before it in `contacts` sticks with contact k.
  bool SticksWithEarlier(size_t k) const {
    for (size_t i = 0; i < k; ++i) {
      if (SticksWith(i, k)) return true;
    }
    return false;
  }
  /// Σ (opens λn + μ |slides| λn + slides λt) over `release`, N; of a mechanism at its limit 0.
  template <typename T, typename Coefficient>
  T WorkLeft(const Coefficient& coefficient_of, const ContactSolution<T>& solution) const {
    T left(0.0);
    for (size_t i = 0; i < release.size(); ++i) {
      const ReleaseRate& rate = release[i];
      if (rate.opens != 0.0) left += rate.opens * solution.normal_impulse[i];
      if (rate.slides == 0.0) continue;
      left += std::abs(rate.slides) * coefficient_of(i) * solution.normal_impulse[i] +
              rate.slides * solution.tangent_impulse[i];
    }
    return left;
  }
  /// The contact whose normal force limits the friction of contact i.
  size_t NormalOf(size_t i) const { return contacts[i].is_rolling ? i - 1 : i; }
  /// Σ (friction · normal force − sign · tangential force) over the contacts that stick with k, N.
  template <typename T>
  T FrictionLeft(size_t k, const T& coefficient, double sign,
                 const ContactSolution<T>& solution) const {
    T left(0.0);
    for (size_t i = 0; i < contacts.size(); ++i) {
      if (SticksWith(i, k)) {
        left += coefficient * solution.normal_impulse[i] - sign * solution.tangent_impulse[i];
      }
    }
    return left;
  }
};

/// One part of a step; `is_impulses` tells which of the two members is valid.
struct EventPart {
  bool is_impulses = false;
  Segment segment;
  Impulses impulses;

  double time() const { return is_impulses ? impulses.time : segment.time; }
  /// The time that tells the pieces on which paths are followed.
  double inside() const { return is_impulses ? impulses.inside : segment.middle; }
};

/// The parts in their order; kept from step to step for their memory.
struct EventRecord {
  std::vector<std::unique_ptr<EventPart>> parts;
  int num_parts = 0;

  void Clear() { num_parts = 0; }
  EventPart* Add();
  /// Memory, bytes, with the parts that are kept for later steps.
  size_t bytes() const;
};

/// The view of a node that VisitJacobian takes.
SolvedEquations ViewOf(const Segment& segment, const SolvedNode& node, bool correction);

}  // namespace tangible
