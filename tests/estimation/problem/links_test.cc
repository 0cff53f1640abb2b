// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/links.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// A double pendulum that is drawn along the direction (3, -4) / 5, with a spring to its end.
constexpr char kTwoLinks[] = R"({"bodies": [
  {"name": "upper", "mass": 0.3, "inertia": 0.002, "position": [0.06, -0.08], "angle": 0.4},
  {"name": "lower", "mass": 0.2, "inertia": 0.001, "position": [0.2, -0.3]}],
  "joints": [
  {"name": "pivot", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
   "angle": 0.3},
  {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"], "anchor": [0.15, -0.2],
   "angle": -0.2}],
  "springs": [{"name": "band", "bodies": ["lower", "world"], "anchors": [[0.2, -0.3], [1, 0]],
   "stiffness": 3, "rest_length": 0.5}],
  "simulation": {"dt": 0.005, "duration": 0.5, "joint_correction": "projection"}})";

std::vector<BodyPoint> Points(const Scene& scene) {
  // The elbow as a point of the upper link, and the end of the lower one.
  const double c = std::cos(-0.4);
  const double s = std::sin(-0.4);
  const double x = 0.15 - 0.06;
  const double y = -0.2 + 0.08;
  EXPECT_EQ(scene.bodies[0].name, "upper");
  return {{"elbow", 0, {c * x - s * y, s * x + c * y}}, {"tip", 1, {0.03, -0.15}}};
}

// The parameter gives the scene that someone draws with another length.
TEST(LinksTest, ALengthMovesWhatHangsAtTheEnd) {
  Scene scene = MakeScene(kTwoLinks);
  const std::vector<BodyPoint> points = Points(scene);
  const std::vector<Link> links = {{"upper", 0, 1, -1}, {"lower", 1, -1, 1}};
  std::vector<FitParameter> parameters = {Parameter(LengthPath(links[0]), 0.3),
                                          Parameter(LengthPath(links[1]), 0.2)};
  parameters[0].initial.reset();
  parameters[1].initial.reset();
  ParameterError error;
  ASSERT_TRUE(ExpandLengths(scene, points, links, &parameters, &error)) << error.what;
  EXPECT_DOUBLE_EQ(*parameters[0].initial, 0.25);
  EXPECT_EQ(*parameters[0].lower, 0.0);
  const Vector2<double> tip = scene.bodies[1].position + points[1].at;
  const double lower = (tip - Vector2<double>(0.15, -0.2)).norm();
  EXPECT_DOUBLE_EQ(*parameters[1].initial, lower);
  ParameterizedScene parameterized;
  ASSERT_TRUE(parameterized.Create(scene, points, parameters, &error)) << error.what;
  ASSERT_TRUE(parameterized.Set(Eigen::Vector2d(0.35, lower)));
  const Scene& longer = parameterized.scene();
  const Vector2<double> moved(0.06, -0.08);  // 0.1 m along the link
  const auto near = [](const Vector2<double>& a, const Vector2<double>& b) {
    return (a - b).norm() < 1e-15;
  };
  EXPECT_TRUE(near(longer.joints[1].anchors[0], Vector2<double>(0.15, -0.2) + moved));
  EXPECT_TRUE(near(longer.bodies[1].position, Vector2<double>(0.2, -0.3) + moved));
  EXPECT_TRUE(near(longer.springs[0].anchors[0], Vector2<double>(0.2, -0.3) + moved));
  EXPECT_TRUE(near(longer.springs[0].anchors[1], Vector2<double>(1.0, 0.0)));
  EXPECT_TRUE(near(longer.bodies[0].position, Vector2<double>(0.06, -0.08)));
  EXPECT_TRUE(near(parameterized.points()[1].at, points[1].at));
  // The point that is drawn at the elbow moves with it, in its body's directions.
  const double c = std::cos(0.4);
  const double s = std::sin(0.4);
  const Vector2<double> at = parameterized.points()[0].at;
  EXPECT_TRUE(near(
      longer.bodies[0].position + Vector2<double>(c * at.x() - s * at.y(), s * at.x() + c * at.y()),
      Vector2<double>(0.15, -0.2) + moved));
}

TEST(LinksTest, ALengthIsFittedLikeAnyNumber) {
  Scene scene = MakeScene(kTwoLinks);
  const std::vector<Link> links = {{"upper", 0, 1, -1}};
  const std::vector<Observation> observations = Observe(scene, 2, 1e-4, 3);
  std::vector<FitParameter> parameters = {Parameter("links/upper/length", 0.28)};
  ParameterError error;
  ASSERT_TRUE(ExpandLengths(scene, {}, links, &parameters, &error)) << error.what;
  RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
  const FitResult fit = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], 0.25, 5.0 * fit.uncertainty.standard_deviation[0]);
  EXPECT_LT(fit.uncertainty.standard_deviation[0], 1e-4);
}

TEST(LinksTest, MistakesAreOneLine) {
  Scene scene = MakeScene(kTwoLinks);
  std::vector<FitParameter> parameters = {Parameter("links/arm/length", 0.3)};
  ParameterError error;
  EXPECT_FALSE(ExpandLengths(scene, {}, {{"upper", 0, 1, -1}}, &parameters, &error));
  EXPECT_EQ(error.what,
            "parameter links/arm/length: matches no number; of links there are: "
            "links/upper/length");
  EXPECT_EQ(error.parameter, 0);
  // The lower link is joined to the world too.
  BasicJoint<double> second = scene.joints[1];
  second.name = "stop";
  second.bodies[1] = -1;
  scene.joints.push_back(second);
  EXPECT_NE(CheckLink(scene, {}, {"upper", 0, 1, -1}).find("hang from it alone"),
            std::string::npos);
  EXPECT_NE(CheckLink(scene, {}, {"same", 1, 1, -1}), "");
}

// A bob whose centre of mass is at the end of its link hangs at the length, and carries the next
// one: the scene that someone draws with other lengths.
TEST(LinksTest, ABobMovesWithTheEndOfItsLink) {
  constexpr char kBobs[] = R"({"bodies": [
    {"name": "upper", "mass": 1, "inertia": 1e-3, "position": [0, -0.4]},
    {"name": "lower", "mass": 0.7, "inertia": 1e-3, "position": [0, -0.7], "angle": 0.5}],
    "joints": [
    {"name": "top", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0], "angle": 1},
    {"name": "middle", "type": "revolute", "bodies": ["lower", "upper"], "anchor": [0, -0.4]}],
    "simulation": {"dt": 0.005, "duration": 0.5}})";
  const Scene scene = MakeScene(kBobs);
  const double c = std::cos(0.5);
  const double s = std::sin(0.5);
  // The lower bob, and a mark on its body at the middle joint.
  const std::vector<BodyPoint> points = {{"bob", 1, {0.0, 0.0}}, {"mark", 1, {s * 0.3, c * 0.3}}};
  const std::vector<Link> links = {{"upper", 0, 1, -1}, {"lower", 1, -1, 0}};
  std::vector<FitParameter> parameters = {Parameter("links/upper/length", 0.4),
                                          Parameter("links/lower/length", 0.3)};
  ParameterError error;
  ASSERT_TRUE(ExpandLengths(scene, points, links, &parameters, &error)) << error.what;
  ParameterizedScene parameterized;
  ASSERT_TRUE(parameterized.Create(scene, points, parameters, &error)) << error.what;
  ASSERT_TRUE(parameterized.Set(Eigen::Vector2d(0.45, 0.28)));
  const Scene& other = parameterized.scene();
  EXPECT_NEAR(other.bodies[0].position.y(), -0.45, 1e-15);
  EXPECT_NEAR(other.bodies[1].position.y(), -0.73, 1e-15);
  EXPECT_NEAR(other.joints[1].anchors[0].y(), -0.45, 1e-15);
  EXPECT_NEAR(other.joints[0].anchors[0].y(), 0.0, 1e-15);
  EXPECT_NEAR(parameterized.points()[0].at.norm(), 0.0, 1e-15);
  // The mark stays at the joint.
  const Vector2<double> at = parameterized.points()[1].at;
  EXPECT_NEAR(c * at.x() - s * at.y(), 0.0, 1e-15);
  EXPECT_NEAR(s * at.x() + c * at.y(), 0.28, 1e-15);

  // One parameter for both, as a pattern.
  std::vector<FitParameter> both = {Parameter("links/*/length", 0.5)};
  ASSERT_TRUE(ExpandLengths(scene, points, links, &both, &error)) << error.what;
  ParameterizedScene equal;
  ASSERT_TRUE(equal.Create(scene, points, both, &error)) << error.what;
  ASSERT_TRUE(equal.Set(Eigen::VectorXd::Constant(1, 0.35)));
  EXPECT_NEAR(equal.scene().bodies[0].position.y(), -0.35, 1e-15);
  EXPECT_NEAR(equal.scene().bodies[1].position.y(), -0.7, 1e-15);
}

}  // namespace
}  // namespace tangible
