// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What tangible-simulate says of a run that is done, on stderr and as `warnings` of the summary: a
// line each.

#include <string>
#include <vector>

#include "tangible/simulation/stepping/joint_opening.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

class RunWarnings {
 public:
  RunWarnings(const Model<double>& model, const State<double>& initial)
      : joints_(model), initial_(initial) {}

  /// Each state of the run. Joints are looked at in one of kLookEvery: they open over many steps,
  /// and a look costs up to a quarter of a chain's step.
  void Add(const Model<double>& model, long k, double t, const State<double>& state) {
    if (joints_.watches() && k % kLookEvery == 0) joints_.Look(model, state, t);
  }

  /// All lines, without a file's name. `final` is the state at the report's time.
  std::vector<std::string> Finish(const Model<double>& model, const RolloutReport& report,
                                  const State<double>& final);

 private:
  static constexpr long kLookEvery = 16;

  JointWatch joints_;
  State<double> initial_;
};

/// Empty, or a line on what `semi_implicit_euler` with event stepping costs.
std::string FirstOrderByEvents(const Model<double>& model, const State<double>& initial,
                               const State<double>& final);

}  // namespace tangible
