// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

TEST(RandomLoadsTest, EveryKindTakesItsTurnOffTheStepsEdges) {
  int springs = 0, forces = 0, signals = 0, torques = 0, efforts = 0, weightless = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Scene scene = RandomScene(seed);
    springs += scene.springs.empty() ? 0 : 1;
    forces += scene.forces.empty() ? 0 : 1;
    weightless += scene.gravity.isZero() ? 1 : 0;
    for (const auto& joint : scene.joints) {
      efforts += joint.effort_signal ? 1 : 0;
    }
    for (const auto& force : scene.forces) {
      signals += force.force_signal ? 1 : 0;
      torques += force.torque_signal ? 1 : 0;
      // The derivative has a kink where an edge is on a step's.
      for (const std::optional<double>& time : {force.start, force.end}) {
        if (!time) continue;
        const double steps = *time / scene.simulation.dt;
        EXPECT_GT(std::abs(steps - std::round(steps)), 0.1) << seed;
      }
    }
  }
  for (const int count : {springs, forces, signals, torques, efforts}) EXPECT_GE(count, 5);
  EXPECT_GE(weightless, 2);
}

}  // namespace
}  // namespace tangible
