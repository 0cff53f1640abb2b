// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A run with the joints' drift along it.

#include <algorithm>

#include "tangible/simulation/stepping/rollout.h"

namespace tangible::testing {

struct DriftOfRun {
  RolloutReport report;
  State<double> last;
  double largest = 0.0;  ///< m or rad, of all states
};

inline DriftOfRun RunForDrift(const Scene& scene) {
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  DriftOfRun run;
  run.report = Rollout(
      model, initial,
      [&](long, double, const State<double>& state, Stepper*) {
        run.largest = std::max(run.largest, JointDrift(model, state));
      },
      &run.last);
  return run;
}

}  // namespace tangible::testing
