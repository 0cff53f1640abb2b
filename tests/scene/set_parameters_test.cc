// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/set_parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

constexpr char kScene[] = R"({"bodies": [
    {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1]},
    {"name": "b", "shape": {"polygon": {"vertices": [[-1, -1], [1, -1], [0, 2]]}}, "mass": 2,
     "inertia": 1, "position": [3, 1]}],
  "joints": [{"name": "j", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 2],
              "limits": [-1, 1]}],
  "forces": [{"name": "f", "body": "a", "force": [1, 0], "start": 0.1, "end": 0.2}]})";

class SetParametersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    ASSERT_TRUE(ParseScene(kScene, "s.json", "", &scene_, &error)) << error;
  }
  std::vector<ParameterPath> Paths(const std::vector<std::string>& paths) {
    std::vector<ParameterPath> parameters(paths.size());
    std::string error;
    for (size_t i = 0; i < paths.size(); ++i) {
      EXPECT_TRUE(ResolveParameter(scene_, paths[i], &parameters[i], &error)) << error;
    }
    return parameters;
  }
  std::string Set(const std::string& path, double value) {
    Scene copy = scene_;
    return SetParameters(Paths({path}), &value, &copy);
  }
  Scene scene_;
};

TEST_F(SetParametersTest, SetsAllNumbersOfEachParameter) {
  const double values[] = {3.5, -2.0};
  EXPECT_EQ(SetParameters(Paths({"bodies/*/mass", "bodies/a/position/x"}), values, &scene_), "");
  EXPECT_EQ(scene_.bodies[0].mass, 3.5);
  EXPECT_EQ(scene_.bodies[1].mass, 3.5);
  EXPECT_EQ(scene_.bodies[0].position.x(), -2.0);
  EXPECT_EQ(scene_.bodies[1].position.x(), 3.0);
}

TEST_F(SetParametersTest, RadiiAreCheckedAsWhenASceneIsRead) {
  std::string error;
  ASSERT_TRUE(ParseScene(R"({"bodies": [{"name": "e", "shape": {"ellipse": {"radii": [1, 2]}},
      "mass": 1, "position": [0, 1]}]})",
                         "s.json", "", &scene_, &error))
      << error;
  EXPECT_EQ(Set("bodies/e/shape/radii/x", 3e-9), "");
  EXPECT_EQ(Set("bodies/e/shape/radii/x", 1e-9),
            "the scene with these values: /bodies/0/shape/ellipse/radii: expected two radii of a "
            "ratio of at most 1e9, got 1e-09 and 2.0");
}

TEST_F(SetParametersTest, RefusesWhatNumbersMayNotBe) {
  EXPECT_EQ(Set("bodies/a/mass", -1.0), "bodies/a/mass: expected a number > 0, got -1.0");
  EXPECT_EQ(Set("bodies/a/restitution", 1.5),
            "bodies/a/restitution: expected a number in [0, 1], got 1.5");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Set("bodies/a/angle", nan).find("bodies/a/angle: expected a number, got "), 0u);
  EXPECT_NE(Set("gravity/y", HUGE_VAL), "");
}

TEST_F(SetParametersTest, RefusesWhatTheSceneCouldNotBeReadWith) {
  EXPECT_EQ(Set("joints/j/limits/0", 0.5), "");
  EXPECT_EQ(Set("joints/j/limits/0", 1.5).find("the scene with these values: /joints/0/limits: "),
            0u);
  EXPECT_EQ(Set("bodies/b/shape/vertices/2/y", 1.0), "");
  EXPECT_NE(Set("bodies/b/shape/vertices/2/y", -2.0), "");
  EXPECT_EQ(Set("forces/f/start", 0.15), "");
  EXPECT_NE(Set("forces/f/start", 0.3), "");
}

TEST_F(SetParametersTest, ANumberHasOneParameter) {
  std::string error;
  EXPECT_TRUE(CheckApart(scene_, Paths({"bodies/*/mass", "bodies/a/angle"}), &error));
  EXPECT_FALSE(CheckApart(scene_, Paths({"bodies/*/mass", "bodies/b/mass"}), &error));
  EXPECT_EQ(error,
            "bodies/b/mass: expected numbers that no other parameter sets, got bodies/b/mass, "
            "which bodies/*/mass sets");
}

}  // namespace
}  // namespace tangible
