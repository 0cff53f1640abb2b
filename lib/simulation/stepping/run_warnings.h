// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The warnings that programs print about a finished run, on stderr and as `warnings` of a summary,
// one line each.

#include <string>
#include <vector>

#include "tangible/simulation/stepping/coordinate_watch.h"
#include "tangible/simulation/stepping/joint_opening.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

class RunWarnings {
 public:
  RunWarnings(const Model<double>& model, const State<double>& initial)
      : joints_(model), coordinates_(model), initial_(initial) {}

  /// Examines a state of the run; `stepper` is null for the initial one. Joints are examined in one
  /// of kLookEvery states, because they open over many steps, and the examination costs up to a
  /// quarter of a chain's step.
  void Add(const Model<double>& model, long k, double t, const State<double>& state,
           const Stepper* stepper) {
    if (stepper != nullptr) {
      coordinates_.LookAtContacts(state, t, stepper->record().contacts);
      LookBehindLines(model, k, t, stepper->record().contacts);
    }
    if (k % kLookEvery != 0) return;
    coordinates_.LookAtJoints(model, state, t);
    if (joints_.watches()) joints_.Look(model, state, t);
  }

  /// The largest rounding of coordinates over the size of a body (CoordinateWatch).
  double rounding() const { return coordinates_.rounding(); }
  /// Empty, or the line that says that coordinates are too large.
  std::string CoordinatesMessage(const Model<double>& model) const {
    return coordinates_.Message(model);
  }

  /// All lines, without a file's name. `final` is the state at the report's time.
  std::vector<std::string> Finish(const Model<double>& model, const RolloutReport& report,
                                  const State<double>& final);

 private:
  static constexpr long kLookEvery = 16;

  /// Keeps the first contact that a body has behind a polyline or spline, deeper than the body is
  /// large, where it was not in contact a step before: it has not come through the line but past
  /// its end.
  void LookBehindLines(const Model<double>& model, long k, double t,
                       const std::vector<ActiveContact>& contacts);

  JointWatch joints_;
  CoordinateWatch coordinates_;
  State<double> initial_;
  std::vector<ActiveContact> last_contacts_;  // with lines, of the last step
  std::string behind_;                        // the line about the first one that is behind
};

}  // namespace tangible
