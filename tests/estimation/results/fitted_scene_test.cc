// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/fitted_scene.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(FittedSceneTest, HasTheEstimateAndTheWholeRun) {
  FitProblem problem;
  problem.scene = MakeScene(kPendulum);
  problem.parameters = {Parameter("joints/pin/angle", 0.9), Parameter("bodies/bob/mass", 0.4)};
  std::string text;
  std::string error;
  ASSERT_TRUE(FittedScene(problem, Eigen::Vector2d(1.0 / 3.0, 0.7), "", &text, &error)) << error;
  const Scene scene = MakeScene(text);
  EXPECT_EQ(scene.joints[0].angle, 1.0 / 3.0);  // to the last bit
  EXPECT_EQ(scene.bodies[0].mass, 0.7);
  EXPECT_EQ(scene.simulation.duration, 2.0);
  EXPECT_EQ(scene.joints[0].damping, problem.scene.joints[0].damping);
  EXPECT_FALSE(FittedScene(problem, Eigen::Vector2d(0.1, -1.0), "", &text, &error));
  EXPECT_NE(error, "");
}

TEST(FittedSceneTest, FilesOfSignalsAreNamedAsSeenFromItsFolder) {
  FitProblem problem;
  problem.scene = MakeScene(kPendulum);
  problem.scene.path = "data/scenes/pendulum.json";
  problem.scene.joints[0].effort_signal.emplace().file = "effort.csv";
  problem.parameters = {Parameter("joints/pin/angle", 0.9)};
  std::string text;
  std::string error;
  const Eigen::VectorXd estimate = Eigen::VectorXd::Constant(1, 0.5);
  ASSERT_TRUE(FittedScene(problem, estimate, "data/out", &text, &error)) << error;
  EXPECT_NE(text.find("\"../scenes/effort.csv\""), std::string::npos) << text;
  ASSERT_TRUE(FittedScene(problem, estimate, "", &text, &error)) << error;
  EXPECT_NE(text.find("\"data/scenes/effort.csv\""), std::string::npos) << text;
}

}  // namespace
}  // namespace tangible
