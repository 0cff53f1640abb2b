// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/parameterized_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

const std::vector<BodyPoint> kPoints = {{"tip", 2, {0.1, 0.2}}, {"end", 0, {0.0, 0.0}}};

FitParameter Bounded(const std::string& path, std::optional<double> lower, double initial,
                     std::optional<double> upper) {
  FitParameter parameter = Parameter(path, initial);
  parameter.lower = lower;
  parameter.upper = upper;
  return parameter;
}

ParameterError Fault(const std::vector<FitParameter>& parameters) {
  ParameterizedScene scene;
  ParameterError error;
  EXPECT_FALSE(scene.Create(MakeScene(kSmallChain), kPoints, parameters, &error));
  return error;
}

TEST(ParameterizedSceneTest, SetsEveryNumberAsScaledAndMoved) {
  FitParameter total = Bounded("bodies/link*/mass", 0.1, 3.0, 10.0);
  total.sets = {{"bodies/link*/mass", 0.5, 0.25}, {"points/tip/at/y", -2.0, 1.0}};
  ParameterizedScene scene;
  ParameterError error;
  ASSERT_TRUE(
      scene.Create(MakeScene(kSmallChain), kPoints, {total, Parameter("gravity/y", -9.0)}, &error))
      << error.what;
  EXPECT_EQ(scene.scene().bodies[1].mass, 1.75);
  EXPECT_EQ(scene.points()[0].at.y(), -5.0);
  ASSERT_TRUE(scene.Set(Eigen::Vector2d(4.0, -10.0)));
  for (int link = 0; link < 3; ++link) {
    EXPECT_EQ(scene.scene().bodies[link].mass, 2.25);
  }
  EXPECT_EQ(scene.scene().bodies[3].mass, 1.0);
  EXPECT_EQ(scene.points()[0].at.y(), -7.0);
  EXPECT_EQ(scene.scene().gravity.y(), -10.0);
  EXPECT_EQ(scene.point_derivatives()(1, 0), -2.0);
  EXPECT_EQ(scene.model().parameters[kGravityY], -10.0);
}

TEST(ParameterizedSceneTest, VariableDerivativesAreThoseOfDifferencesAtEachPoint) {
  // The initial angle of j1 turns two links: its derivative depends on where it stands.
  ParameterizedScene scene;
  ParameterError error;
  FitParameter mass = Bounded("bodies/link*/mass", 0.1, 2.0, 10.0);
  mass.sets[0].scale = 0.5;
  ASSERT_TRUE(
      scene.Create(MakeScene(kSmallChain), {}, {mass, Parameter("joints/j1/angle", 0.4)}, &error));
  const Eigen::Vector2d p(2.0, 0.7);
  ASSERT_TRUE(scene.Set(p));
  const RowMatrixXd derivatives = scene.VariableDerivatives();
  const auto variables = [&scene](const Eigen::VectorXd& at) {
    EXPECT_TRUE(scene.Set(at));
    std::vector<double> all = scene.initial_state().pose;
    all.insert(all.end(), scene.initial_state().twist.begin(), scene.initial_state().twist.end());
    all.insert(all.end(), scene.model().parameters.begin(), scene.model().parameters.end());
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(all.data(), all.size()));
  };
  const double h = 1e-6;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = h * Eigen::Vector2d::Unit(k);
    const Eigen::VectorXd difference = (variables(p + step) - variables(p - step)) / (2.0 * h);
    EXPECT_GT(derivatives.col(k).norm(), 0.1);
    EXPECT_LT((derivatives.col(k) - difference).cwiseAbs().maxCoeff(), 1e-8);
  }
}

TEST(ParameterizedSceneTest, PositiveBoundsRunInLogarithms) {
  ParameterizedScene scene;
  ParameterError error;
  ASSERT_TRUE(scene.Create(
      MakeScene(kSmallChain), {},
      {Bounded("bodies/ball/mass", {}, 2.0, {}), Bounded("bodies/ball/friction", {}, 0.0, {}),
       Bounded("bodies/ball/position/x", 0.5, 0.75, 2.0)},
      &error))
      << error.what;
  EXPECT_TRUE(scene.entries()[0].logarithmic);
  EXPECT_FALSE(scene.entries()[1].logarithmic);
  EXPECT_EQ(scene.entries()[1].lower, 0.0);
  EXPECT_TRUE(scene.entries()[2].logarithmic);
  const Eigen::Vector3d p(3.0, 0.25, 2.0);
  const Eigen::VectorXd q = ToInternal(scene.entries(), p);
  EXPECT_LT((ToParameters(scene.entries(), q) - p).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LE(ToParameters(scene.entries(), q)[2], 2.0);
  const double h = 1e-6;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = (k == 2 ? -h : h) * Eigen::Vector3d::Unit(k);
    const double difference =
        (ToParameters(scene.entries(), q + step) - ToParameters(scene.entries(), q))[k] / step[k];
    EXPECT_NEAR(ParametersByInternal(scene.entries(), p)[k], difference,
                1e-5 * std::abs(difference));
  }
}

TEST(ParameterizedSceneTest, ValuesThatANumberMayNotTakeAreRefused) {
  ParameterizedScene scene;
  ParameterError error;
  ASSERT_TRUE(
      scene.Create(MakeScene(kSmallChain), {}, {Parameter("bodies/ball/mass", 1.0)}, &error));
  EXPECT_FALSE(scene.Set(Eigen::VectorXd::Constant(1, -1.0)));
  EXPECT_FALSE(scene.Set(Eigen::VectorXd::Constant(1, std::nan(""))));
  EXPECT_TRUE(scene.Set(Eigen::VectorXd::Constant(1, 1.0)));
}

// Radii beyond the ratio that a scene may have make an evaluation fail, from which a fit steps
// back.
TEST(ParameterizedSceneTest, RadiiAreCheckedAsWhenASceneIsRead) {
  Scene scene = MakeScene(kFallingBall);
  scene.bodies[0].shape = {ShapeType::kEllipse, {1.0, 2.0}};
  ParameterizedScene fitted;
  ParameterError error;
  ASSERT_TRUE(
      fitted.Create(scene, {}, {Bounded("bodies/ball/shape/radii/x", {}, 1.0, 1e12)}, &error))
      << error.what;
  EXPECT_TRUE(fitted.Set(Eigen::VectorXd::Constant(1, 1.9e9)));
  EXPECT_FALSE(fitted.Set(Eigen::VectorXd::Constant(1, 2.1e9)));
  EXPECT_FALSE(fitted.Set(Eigen::VectorXd::Constant(1, 1.9e-9)));
  EXPECT_FALSE(fitted.Create(scene, {}, {Parameter("bodies/ball/shape/radii/x", 1e11)}, &error));
  EXPECT_EQ(error.what,
            "the initial values give a number that is not allowed: the scene with these values: "
            "/bodies/0/shape/ellipse/radii: expected two radii of a ratio of at most 1e9, got "
            "100000000000.0 and 2.0");
}

TEST(ParameterizedSceneTest, LimitsAndOutlinesAreCheckedAsWhenASceneIsRead) {
  Scene scene = MakeScene(kPendulum);
  scene.joints[0].limits = {-1.5, 1.5};
  ParameterizedScene fitted;
  ParameterError error;
  const FitParameter low = Parameter("joints/pin/limits/0", -1.2);
  ASSERT_TRUE(fitted.Create(scene, {}, {low}, &error)) << error.what;
  EXPECT_TRUE(fitted.Set(Eigen::VectorXd::Constant(1, 0.9)));
  EXPECT_FALSE(fitted.Set(Eigen::VectorXd::Constant(1, 1.6)));
  // A concave polygon whose notch must not reach through its back.
  scene.bodies[0].shape = {ShapeType::kPolygon,
                           {-1.0, -1.0, 1.0, -1.0, 1.0, 3.0, 0.0, 2.0, -1.0, 3.0}};
  scene.bodies[0].inertia = 1.0;
  ASSERT_TRUE(fitted.Create(scene, {}, {Parameter("bodies/bob/shape/vertices/3/y", 2.0)}, &error))
      << error.what;
  EXPECT_TRUE(fitted.Set(Eigen::VectorXd::Constant(1, -0.9)));
  EXPECT_FALSE(fitted.Set(Eigen::VectorXd::Constant(1, -1.1)));
}

TEST(ParameterizedSceneTest, ParametersThatAddShareANumber) {
  FitParameter shift = Parameter("bodies/link*/position/y", 0.5);
  shift.sets[0].mode = SetMode::kAdd;
  shift.sets.push_back({"points/tip/at/y", 2.0, 0.25, SetMode::kAdd});
  FitParameter link = Parameter("bodies/link1/position/y", -3.0);
  link.sets[0].scale = 2.0;
  ParameterizedScene scene;
  ParameterError error;
  const Scene drawn = MakeScene(kSmallChain);
  ASSERT_TRUE(scene.Create(drawn, kPoints, {shift, link}, &error)) << error.what;
  // Added to what the scene has, and to what another parameter sets.
  EXPECT_EQ(scene.scene().bodies[0].position.y(), drawn.bodies[0].position.y() + 0.5);
  EXPECT_EQ(scene.scene().bodies[1].position.y(), -6.0 + 0.5);
  EXPECT_EQ(scene.points()[0].at.y(), 0.2 + 1.25);
  ASSERT_TRUE(scene.Set(Eigen::Vector2d(1.0, -4.0)));
  EXPECT_EQ(scene.scene().bodies[0].position.y(), drawn.bodies[0].position.y() + 1.0);
  EXPECT_EQ(scene.scene().bodies[1].position.y(), -8.0 + 1.0);
  const RowMatrixXd derivatives = scene.VariableDerivatives();
  // y of link1's pose, which joint j1 has turned by 0.1 about a fixed anchor.
  EXPECT_NEAR(derivatives(4, 0), std::cos(0.1), 1e-15);
  EXPECT_NEAR(derivatives(4, 1), 2.0 * std::cos(0.1), 1e-15);
  EXPECT_EQ(scene.point_derivatives()(1, 0), 2.0);
  // By default nothing is added; a sum that is not allowed is refused.
  shift.initial.reset();
  ASSERT_TRUE(scene.Create(drawn, kPoints, {shift}, &error)) << error.what;
  EXPECT_EQ(scene.Initial()[0], 0.0);
  FitParameter mass = Parameter("bodies/ball/mass", 0.0);
  mass.sets[0].mode = SetMode::kAdd;
  ASSERT_TRUE(scene.Create(drawn, kPoints, {mass}, &error)) << error.what;
  EXPECT_FALSE(scene.Set(Eigen::VectorXd::Constant(1, -1000.0)));
}

TEST(ParameterizedSceneTest, MistakesSayWhichParameterAndKey) {
  const ParameterError nothing = Fault({Parameter("bodies/bal/mass", 1.0)});
  EXPECT_EQ(nothing.parameter, 0);
  EXPECT_EQ(nothing.set, 0);
  EXPECT_EQ(nothing.key, "path");
  EXPECT_NE(nothing.what.find("matches no number"), std::string::npos) << nothing.what;

  const ParameterError twice =
      Fault({Parameter("bodies/link*/mass", 1.0), Parameter("bodies/link1/mass", 1.0)});
  EXPECT_EQ(twice.parameter, 1);
  EXPECT_NE(twice.what.find("bodies/link1/mass is set twice"), std::string::npos) << twice.what;

  FitParameter same = Parameter("gravity/y", 1.0);
  same.name = "bodies/ball/mass";
  EXPECT_EQ(Fault({Parameter("bodies/ball/mass", 1.0), same}).key, "name");

  EXPECT_EQ(Fault({Bounded("bodies/ball/mass", 2.0, 1.0, 3.0)}).key, "initial");
  EXPECT_EQ(Fault({Bounded("bodies/ball/mass", 3.0, 3.0, 2.0)}).key, "lower");
  EXPECT_EQ(Fault({Bounded("bodies/ball/mass", 0.0, 1.0, 2.0)}).key, "lower");
  EXPECT_EQ(Fault({Bounded("bodies/ball/restitution", 0.0, 0.5, 1.5)}).key, "upper");
  EXPECT_EQ(Fault({Bounded("bodies/ball/mass", {}, -1.0, {})}).key, "initial");
  EXPECT_EQ(Fault({Parameter("points/tap/at/x", 1.0)}).key, "path");
  FitParameter still = Parameter("gravity/y", 1.0);
  still.sets[0].scale = 0.0;
  EXPECT_EQ(Fault({still}).key, "scale");
  still.sets.clear();
  EXPECT_EQ(Fault({still}).key, "sets");
  EXPECT_EQ(Fault({}).parameter, -1);
  // mass = 1 - p > 0 needs a largest p that only the user can choose.
  FitParameter reverse = Parameter("bodies/ball/mass", 0.0);
  reverse.sets[0].scale = -1.0;
  reverse.sets[0].offset = 1.0;
  EXPECT_EQ(Fault({reverse}).key, "upper");
}

// Gears that mesh, and a rope over a pulley whose ends start at their bodies' velocities.
TEST(ParameterizedSceneTest, InitialRatesObeyAKeptCoupling) {
  const Scene scene = MakeScene(R"({"bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]},
      {"name": "b", "mass": 1, "inertia": 1, "position": [1, 0]},
      {"name": "left", "mass": 1, "inertia": 1, "position": [3, 0], "velocity": [0, 2]},
      {"name": "right", "mass": 1, "inertia": 1, "position": [4, 0], "velocity": [0, -2]}],
    "joints": [
      {"name": "p", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0], "rate": 1},
      {"name": "q", "type": "revolute", "bodies": ["b", "world"], "anchor": [1, 0], "rate": -0.5},
      {"name": "mesh", "type": "coupling", "joints": ["p", "q"], "ratio": 2},
      {"name": "l", "type": "distance", "bodies": ["left", "world"], "anchors": [[3, 0], [3, 5]],
       "limits": [0, null]},
      {"name": "r", "type": "distance", "bodies": ["world", "right"], "anchors": [[4, 5], [4, 0]],
       "limits": [0, null]},
      {"name": "rope", "type": "coupling", "joints": ["l", "r"], "ratio": 1}]})");
  const auto fault_of = [&](const std::vector<FitParameter>& parameters) {
    ParameterizedScene parameterized;
    ParameterError error;
    return parameterized.Create(scene, {}, parameters, &error) ? "" : error.what;
  };
  EXPECT_EQ(fault_of({Parameter("joints/p/rate", 1.0)}), "");
  EXPECT_EQ(fault_of({Parameter("joints/p/rate", 1.5)}),
            "the scene with the initial values: /joints/2: expected initial rates with rate(p) + "
            "ratio * rate(q) = 0, got 0.5");
  EXPECT_EQ(fault_of({Parameter("bodies/left/velocity/y", 2.0)}), "");
  EXPECT_EQ(fault_of({Parameter("bodies/left/velocity/y", 2.25)}),
            "the scene with the initial values: /joints/5: expected initial rates with rate(l) + "
            "ratio * rate(r) = 0, got -0.25");
}

}  // namespace
}  // namespace tangible
