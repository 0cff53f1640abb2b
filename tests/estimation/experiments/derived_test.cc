// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/derived.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

constexpr const char* kPendulum = R"({
  "bodies": [
    {"name": "link1", "mass": 2, "inertia": 0.5, "position": [0, -0.25]},
    {"name": "link2", "mass": 3, "inertia": 0.25, "position": [0, -1.5]} ],
  "joints": [
    {"name": "pivot", "type": "revolute", "bodies": ["link1", "world"], "anchor": [0, 0]},
    {"name": "elbow", "type": "revolute", "bodies": ["link2", "link1"], "anchor": [0, -1]} ] })";

Scene Parse(const std::string& text) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(text, "scene", ".", &scene, &error)) << error;
  return scene;
}

TEST(DerivedTest, RatiosOfADoublePendulum) {
  const Scene scene = Parse(kPendulum);
  // p1 = 2 / 16 + 0.5 + 3, p2 = 3 / 4 + 0.25, p3 = 1.5, p4 = 0.5 + 3.
  const double expected[] = {3.625 / 1.5, 1.0 / 1.5, 3.5 / 1.5, 9.81};
  const auto functions = DoublePendulumQuantities();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(functions[i].value(scene), expected[i], 1e-14) << functions[i].name;
  }
}

TEST(DerivedTest, IntervalsFollowFromTheCovariance) {
  ParameterizedScene scene;
  ParameterError error;
  std::vector<FitParameter> parameters(3);
  const char* paths[] = {"bodies/link1/inertia", "bodies/link2/inertia", "gravity/y"};
  for (int k = 0; k < 3; ++k) {
    parameters[k].name = paths[k];
    parameters[k].sets = {{paths[k]}};
  }
  ASSERT_TRUE(scene.Create(Parse(kPendulum), {}, parameters, &error)) << error.what;
  RowMatrixXd covariance(3, 3);
  const double none = std::nan("");
  covariance << 0.04, 0.0, none, 0.0, 0.09, none, none, none, none;
  const auto derived = Derive(DoublePendulumQuantities(), scene.Initial(), covariance, &scene);
  EXPECT_NEAR(derived[0].standard_deviation, 0.2 / 1.5, 1e-8);
  EXPECT_NEAR(derived[1].standard_deviation, 0.3 / 1.5, 1e-8);
  EXPECT_NEAR(derived[1].high - derived[1].estimate, 1.959964 * 0.2, 1e-6);
  EXPECT_EQ(derived[2].standard_deviation, 0.0);
  // Gravity is held: it has no variance.
  EXPECT_EQ(derived[3].standard_deviation, 0.0);
  EXPECT_NEAR(derived[3].estimate, 9.81, 1e-14);
}

TEST(DerivedTest, SinglePendulum) {
  const Scene scene = Parse(R"({
    "gravity": [0, -10],
    "bodies": [ {"name": "pendulum", "mass": 2, "inertia": 0.5, "position": [0, -0.5]} ],
    "joints": [ {"name": "pivot", "type": "revolute", "bodies": ["pendulum", "world"], "anchor": [0, 0],
                 "damping": 0.2} ] })");
  const auto functions = SinglePendulumQuantities();
  EXPECT_NEAR(functions[0].value(scene), 1.0, 1e-14);
  EXPECT_NEAR(functions[1].value(scene), 0.2 / (2.0 * std::sqrt(10.0)), 1e-14);
}

}  // namespace
}  // namespace tangible
