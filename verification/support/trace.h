// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs with the discrete choices that they made: two runs belong to the same smooth map if these
// are the same, contact by contact.

#include <memory>
#include <string>
#include <vector>

#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

/// A closed contact of a step, with all discrete choices that its equations depend on.
struct ContactTrace {
  ActiveContact contact;
  ContactMode mode = ContactMode::kOpen;
  bool friction_tie = false, restitution_tie = false;  ///< at a kink of the mixing rule
  bool driven = false;  ///< by Poisson's law, in decompression: pushed by e times its compression
  /// With event stepping: the event that ended a segment there, in place of a closed contact.
  EventKind event = EventKind::kStepEnd;
};

/// A run with its discrete choices.
struct RunTrace {
  bool done = false;
  std::string message;
  VectorX<double> values;  ///< outputs
  /// The closed contacts of each step; with event stepping of each segment or impact.
  std::vector<std::vector<ContactTrace>> steps;
  std::vector<long> step_of;  ///< the step of each of these
  std::shared_ptr<const ModelStructure> structure;
  int closed = 0;      ///< closed contacts, over all steps
  int sliding = 0;     ///< of these, sliding
  int sticking = 0;    ///< of these, sticking
  int limits = 0;      ///< of these, joint limits
  int impacts = 0;     ///< of these, with restitution
  int recoveries = 0;  ///< of these, in penetration at the recovery speed
  int degenerate = 0;  ///< contacts within 1e-7 of a change of mode
  /// A closed contact's coefficient is at a kink of its mixing rule.
  bool friction_tie = false, restitution_tie = false;
};

RunTrace TraceRun(const Scene& scene);

/// Whether two runs made the same choices at closed contacts. kMaySlide: contacts
/// without friction are the same as sliding ones (one-sided differences from friction 0).
enum class FrictionAtZero { kDistinct, kMaySlide };
bool SameChoices(const RunTrace& x, const RunTrace& y, FrictionAtZero friction);
/// The first step and contact in which the choices differ; empty if they are the same.
std::string FirstDifference(const RunTrace& x, const RunTrace& y, FrictionAtZero friction);

}  // namespace tangible
