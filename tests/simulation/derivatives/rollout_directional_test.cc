// SPDX-License-Identifier: Apache-2.0
//
// One-sided derivatives at kinks, against one-sided differences.
#include "tangible/simulation/derivatives/rollout_directional.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ostream>

#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

struct Case {
  std::string name;
  std::string scene;
  std::vector<std::string> parameters;
  std::string verdict;  // begins with
  bool one_row;         // of each degenerate step
};

std::ostream& operator<<(std::ostream& out, const Case& test) { return out << test.name; }

std::string SimulationOf(int steps) {
  return R"("simulation": {"dt": 0.0078125, "duration": )" + std::to_string(steps * 0.0078125) +
         "}";
}

// A disc that cannot turn, pushed sideways with its friction: μ m g = 4 N.
std::string PushedDisc(const std::string& floors) {
  return R"({"gravity": [0, -8], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5],
       "friction": 0.5}, )" +
         floors + R"(],
    "joints": [{"name": "upright", "type": "fixed_angle", "bodies": ["disc", "world"]}],
    "forces": [{"name": "push", "body": "disc", "force": [4, 0]}], )" +
         SimulationOf(8) + "}";
}

std::string Floor(const std::string& name) {
  return R"({"name": ")" + name + R"(", "static": true, "friction": 0.5,
             "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
}

std::string PushedBox(double force, const std::string& more = "") {
  return R"({"gravity": [0, -8], "bodies": [
      {"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1, "position": [0, 0.25],
       "friction": 0.5}, )" +
         Floor("floor") + more + R"(],
    "forces": [{"name": "push", "body": "box", "force": [)" +
         std::to_string(force) + R"(, 0]}], )" + SimulationOf(8) + "}";
}

// Beside the floor without gravity: touching, without force.
std::string GrazingBall(const std::string& velocity, const std::string& floors) {
  return R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5],
       "velocity": )" +
         velocity + R"(, "friction": 0.5}, )" + floors + R"(], )" + SimulationOf(4) + "}";
}

// A box on three supports in a row.
std::string ThreePointBox() {
  const auto support = [](const std::string& name, const std::string& x) {
    return R"({"name": ")" + name + R"(", "static": true, "friction": 0.5,
               "shape": {"circle": {"radius": 0.25}}, "position": [)" +
           x + ", -0.25]}";
  };
  return R"({"gravity": [0, -8], "bodies": [
      {"name": "box", "shape": {"box": {"size": [2, 0.5]}}, "mass": 1, "position": [0, 0.25],
       "friction": 0.5}, )" +
         support("left", "-0.75") + ", " + support("middle", "0") + ", " +
         support("right", "0.75") + R"(],
      "forces": [{"name": "push", "body": "box", "force": [0, 0], "at": [0.25, 0]}], )" +
         SimulationOf(4) + "}";
}

// A rod that hangs at its joint's limit, without force.
std::string ArmAtItsStop() {
  return R"({"gravity": [0, -8], "bodies": [
      {"name": "rod", "shape": {"capsule": {"length": 0.5, "radius": 0.05}}, "mass": 0.5,
       "position": [0, 0], "angle": 1.5707963267948966}],
      "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"],
                  "anchor": [0, 0.25], "limits": [0, 2], "rate": 0}], )" +
         SimulationOf(8) + "}";
}

// A slider with dry friction, pushed with as much.
std::string PushedSlider() {
  return R"({"gravity": [0, -8], "bodies": [{"name": "box", "mass": 1, "inertia": 1,
       "position": [0, 0]}],
      "joints": [{"name": "rail", "type": "prismatic", "bodies": ["box", "world"],
                  "anchor": [0, 0], "axis": [1, 0], "friction": 4, "effort": 4}], )" +
         SimulationOf(8) + "}";
}

std::vector<Case> Cases() {
  return {
      {"disc at the limit",
       PushedDisc(Floor("floor")),
       {"bodies/floor/friction", "forces/push/force/x", "bodies/disc/mass", "gravity/y",
        "bodies/disc/velocity/x"},
       "near a kink: kink of 8 rows",
       true},
      {"disc at the limit on two floors",
       PushedDisc(Floor("floor") + ", " + Floor("again")),
       {"bodies/*/friction", "forces/push/force/x", "bodies/disc/mass", "gravity/y",
        "bodies/disc/velocity/x"},
       "near a kink: kink of 16 rows",
       false},
      {"box at the limit",
       PushedBox(4),
       {"bodies/floor/friction", "forces/push/force/x", "bodies/box/mass", "gravity/y",
        "bodies/box/velocity/x"},
       "near a kink: kink of 16 rows",
       false},
      {"grazing, sliding",
       GrazingBall("[1, 0]", Floor("floor")),
       {"bodies/ball/position/y", "bodies/ball/velocity/y", "bodies/ball/shape/radius",
        "bodies/floor/shape/offset", "gravity/y"},
       "near a kink: kink of ",
       true},
      {"grazing at rest",
       GrazingBall("[0, 0]", Floor("floor")),
       {"bodies/ball/position/y", "bodies/ball/velocity/y", "bodies/ball/velocity/x", "gravity/y"},
       "near a kink: kink of ",
       true},
      {"grazing on two floors",
       GrazingBall("[1, 0]", Floor("floor") + ", " + Floor("again")),
       {"bodies/ball/position/y", "bodies/ball/velocity/y", "gravity/y"},
       "near a kink: kink of ",
       false},
      {"three-point box",
       ThreePointBox(),
       {"bodies/box/mass", "forces/push/force/x", "forces/push/force/y", "bodies/box/position/y",
        "bodies/middle/position/y", "bodies/left/position/y", "bodies/right/shape/radius"},
       "one-sided: redundant contacts contradict",
       false},
      {"slider at the limit",
       PushedSlider(),
       {"joints/rail/friction", "joints/rail/effort", "bodies/box/mass", "joints/rail/rate"},
       "near a kink: kink of 8 rows",
       true},
      {"arm at its stop",
       ArmAtItsStop(),
       {"joints/pin/rate", "gravity/y", "bodies/rod/mass"},
       "near a kink: kink of ",
       false},
  };
}

GradientResult Jacobian(const Scene& scene, const std::vector<ParameterPath>& parameters,
                        DerivativeSide side) {
  return FinalStateJacobian(scene, parameters, {.method = GradientMethod::kTangent, .side = side});
}

VectorX<double> Final(Scene scene, const ParameterPath& parameter, double shift) {
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
  for (const int number : parameter.numbers) {
    *numbers[number].value += shift;
  }
  return FinalStateJacobian(
             scene, {}, {.method = GradientMethod::kTangent, .certificate = CertificatePass::kSkip})
      .values;
}

// (−3 f(p) + 4 f(p + h) − f(p + 2h)) / 2h.
VectorX<double> Difference(const Scene& scene, const ParameterPath& parameter, double h) {
  return (-3.0 * Final(scene, parameter, 0.0) + 4.0 * Final(scene, parameter, h) -
          Final(scene, parameter, 2.0 * h)) /
         (2.0 * h);
}

class OneSidedTest : public ::testing::TestWithParam<Case> {};

TEST_P(OneSidedTest, AgreesWithOneSidedDifferences) {
  const Case& test = GetParam();
  const Scene scene = SceneOf(test.scene);
  std::vector<ParameterPath> parameters;
  for (const std::string& path : test.parameters) {
    std::string error;
    ASSERT_TRUE(ResolveParameter(scene, path, &parameters.emplace_back(), &error)) << error;
  }
  const GradientResult element = Jacobian(scene, parameters, DerivativeSide::kBoth);
  const GradientResult plus = Jacobian(scene, parameters, DerivativeSide::kPlus);
  const GradientResult minus = Jacobian(scene, parameters, DerivativeSide::kMinus);
  ASSERT_TRUE(element.done && plus.done && minus.done) << plus.message << minus.message;
  EXPECT_EQ(element.certificate.verdict.rfind(test.verdict, 0), 0u) << element.certificate.verdict;
  EXPECT_TRUE(element.jacobian.allFinite());
  bool kink = false;
  for (size_t k = 0; k < parameters.size(); ++k) {
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    const double h = 1e-6;
    const VectorX<double> above = Difference(scene, parameters[k], h);
    const VectorX<double> below = Difference(scene, parameters[k], -h);
    for (Eigen::Index i = 0; i < above.size(); ++i) {
      const std::string where = "d " + element.outputs[i] + " / d " + parameters[k].path;
      // Coordinates of 0.5 m are known to 1e-16 m, speeds that follow from them to 1e-14 m/s: the
      // differences have 1e-7 of rounding.
      const double scale = std::max({0.1, std::abs(above[i]), std::abs(below[i])});
      EXPECT_NEAR(plus.jacobian(i, column), above[i], 1e-6 * scale) << where << " from above";
      EXPECT_NEAR(minus.jacobian(i, column), below[i], 1e-6 * scale) << where << " from below";
      kink = kink || std::abs(above[i] - below[i]) > 1e-3 * scale;
      if (test.one_row) {
        const double low = std::min(plus.jacobian(i, column), minus.jacobian(i, column));
        const double high = std::max(plus.jacobian(i, column), minus.jacobian(i, column));
        EXPECT_GE(element.jacobian(i, column), low - 1e-12 * scale) << where;
        EXPECT_LE(element.jacobian(i, column), high + 1e-12 * scale) << where;
      }
    }
  }
  EXPECT_TRUE(kink) << "the sides are alike: no test of a kink";
}

INSTANTIATE_TEST_SUITE_P(Kinks, OneSidedTest, ::testing::ValuesIn(Cases()),
                         [](const ::testing::TestParamInfo<Case>& info) {
                           std::string name = info.param.name;
                           for (char& c : name) {
                             c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           }
                           return name;
                         });

// Friction that leaves 0 under a body at rest has one side; a pushed one then sticks.
TEST(OneSidedTest, FrictionAtZeroHasOneSide) {
  const std::string rest = R"({"gravity": [0, -8], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "joints": [{"name": "upright", "type": "fixed_angle", "bodies": ["disc", "world"]}], )" +
                           SimulationOf(4) + "}";
  const Scene scene = SceneOf(rest);
  std::vector<ParameterPath> friction(1);
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene, "bodies/disc/friction", friction.data(), &error)) << error;
  const GradientResult plus = Jacobian(scene, friction, DerivativeSide::kPlus);
  ASSERT_TRUE(plus.done) << plus.message;
  EXPECT_LT(plus.jacobian.cwiseAbs().maxCoeff(), 1e-15);
  const GradientResult minus = Jacobian(scene, friction, DerivativeSide::kMinus);
  EXPECT_FALSE(minus.done);
  EXPECT_NE(minus.message.find("no derivative from below"), std::string::npos) << minus.message;
}

// Of two parameters that grow together, friction and the push, the faster decides: sides do not add
// up.
TEST(OneSidedTest, IsNotLinearInItsDirection) {
  const Scene scene = SceneOf(PushedDisc(Floor("floor")));
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  std::vector<ParameterPath> parameters(2);
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene, "bodies/*/friction", &parameters[0], &error)) << error;
  ASSERT_TRUE(ResolveParameter(scene, "forces/push/force/x", &parameters[1], &error)) << error;
  const RowMatrixXd one = RowMatrixXd(VariableJacobian(
      scene, model.structure, {DirectionOf(parameters[0]), DirectionOf(parameters[1])}));
  // μ m g grows by 8 a unit of friction: the push wins where it grows by more.
  for (const double push : {0.0, 4.0, 8.0, 12.0}) {
    RowMatrixXd w_dot = one.col(0) + push * one.col(1);
    Stepper stepper(model);
    const RolloutReport report = RolloutDirectional(model, initial, {}, &stepper, &w_dot, &final);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_NEAR(w_dot(model.structure->TwistVariable(0, 0), 0), std::max(0.0, push - 8.0) / 16.0,
                1e-13)
        << push;
  }
}

// A pile of boxes at rest absorbs a push in one step; what is left of the direction is rounding,
// which contradicts redundant contacts and means nothing.
TEST(OneSidedTest, APileAbsorbsAPush) {
  std::string bodies;
  for (int row = 0; row < 3; ++row) {
    for (int i = 0; i < 3 - row; ++i) {
      bodies += R"({"name": "b)" + std::to_string(row) + std::to_string(i) +
                R"(", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1, "friction": 0.5,
                "position": [)" +
                std::to_string(1.1 * i + 0.55 * row) + ", " + std::to_string(0.25 + 0.5 * row) +
                "]}, ";
    }
  }
  const Scene scene = SceneOf(R"({"gravity": [0, -9.81], "bodies": [)" + bodies + Floor("floor") +
                              R"(], "simulation": {"dt": 0.01, "duration": 0.2}})");
  std::vector<ParameterPath> push(1);
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene, "bodies/b20/velocity/x", push.data(), &error)) << error;
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const GradientResult result = Jacobian(scene, push, side);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_LT(result.jacobian.cwiseAbs().maxCoeff(), 1e-12);
  }
}

// One line: no sides with other methods.
TEST(OneSidedTest, SaysWhereItIsNotAvailable) {
  Scene scene = SceneOf(PushedDisc(Floor("floor")));
  std::vector<ParameterPath> push(1);
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene, "forces/push/force/x", push.data(), &error)) << error;
  const GradientResult adjoint = FinalStateJacobian(
      scene, push, {.method = GradientMethod::kAdjoint, .side = DerivativeSide::kPlus});
  EXPECT_FALSE(adjoint.done);
  EXPECT_NE(adjoint.message.find("expected the method tangent"), std::string::npos);
}

}  // namespace
}  // namespace tangible
