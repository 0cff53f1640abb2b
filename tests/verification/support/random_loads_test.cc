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

// Every fourth scene has them; the others are what they were before.
TEST(RandomLoadsTest, EllipsesAndContactPoints) {
  int ellipses = 0;
  int points = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    for (const BasicBody<double>& body : RandomScene(seed).bodies) {
      const bool is_ellipse = body.shape.type == ShapeType::kEllipse;
      ellipses += is_ellipse ? 1 : 0;
      points += static_cast<int>(body.contact_points.size());
      EXPECT_TRUE(seed % 4 == 1 || (!is_ellipse && body.contact_points.empty())) << seed;
    }
  }
  EXPECT_GE(ellipses, 10);
  EXPECT_GE(points, 10);
}

}  // namespace
}  // namespace tangible
