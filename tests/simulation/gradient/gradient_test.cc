// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::HaveJets;
using testing::Resolve;

GradientOptions Method(GradientMethod method) {
  GradientOptions options;
  options.method = method;
  return options;
}

// |a − b| ≤ tolerance max(|b|, 1e-3 of the column's largest) + rounding: entries that cancel are
// sums of larger ones.
void ExpectClose(const RowMatrixXd& a, const RowMatrixXd& b, double tolerance, double rounding,
                 const std::string& what) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.cols(), b.cols());
  for (Eigen::Index c = 0; c < a.cols(); ++c) {
    const double floor = 1e-3 * b.col(c).cwiseAbs().maxCoeff();
    for (Eigen::Index r = 0; r < a.rows(); ++r) {
      EXPECT_LE(std::abs(a(r, c) - b(r, c)),
                tolerance * std::max(std::abs(b(r, c)), floor) + rounding)
          << what << " output " << r << " parameter " << c << ": " << a(r, c) << " and " << b(r, c);
    }
  }
}

// Twists of up to 10 are found to 1e-15 and divided by steps of 6e-6 of a scale of at least 0.1.
constexpr double kDifferenceRounding = 1e-15 * 10.0 / 6e-7;

const std::vector<std::string> kMixtureParameters = {"gravity/y",
                                                     "bodies/ball/mass",
                                                     "bodies/crate/mass",
                                                     "bodies/crate/inertia",
                                                     "bodies/rod/mass",
                                                     "bodies/ball/position/y",
                                                     "bodies/ball/velocity/x",
                                                     "bodies/ball/angular_velocity",
                                                     "bodies/*/friction",
                                                     "bodies/ball/restitution",
                                                     "bodies/ball/linear_damping",
                                                     "bodies/ball/angular_damping",
                                                     "bodies/ball/shape/radius",
                                                     "bodies/crate/shape/size/y",
                                                     "bodies/floor/shape/offset",
                                                     "joints/pin/anchor/x",
                                                     "joints/pin/angle",
                                                     "joints/pin/rate",
                                                     "joints/pin/damping",
                                                     "joints/pin/effort",
                                                     "springs/s/stiffness",
                                                     "springs/s/damping",
                                                     "springs/s/rest_length",
                                                     "springs/s/anchors/1/x",
                                                     "forces/push/force/x",
                                                     "forces/push/torque",
                                                     "forces/push/at/y",
                                                     "forces/push/start",
                                                     "forces/push/end"};

TEST(FinalStateJacobian, MethodsAgree) {
  const Scene scene = SceneOf(test_scenes::Mixture());
  const std::vector<ParameterPath> parameters = Resolve(scene, kMixtureParameters);
  const GradientResult adjoint =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kAdjoint));
  ASSERT_TRUE(adjoint.done) << adjoint.message;
  EXPECT_EQ(adjoint.certificate.verdict, "of the discrete map: trustworthy");
  EXPECT_GT(adjoint.certificate.mode_switches, 4);
  for (Eigen::Index c = 0; c < adjoint.jacobian.cols(); ++c) {
    EXPECT_GT(adjoint.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-6) << kMixtureParameters[c];
  }
  const GradientResult tangent =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kTangent));
  ExpectClose(adjoint.jacobian, tangent.jacobian, 1e-9, 1e-13, "adjoint, tangent");
  const GradientResult differences =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kFiniteDifference));
  ASSERT_TRUE(differences.done) << differences.message;
  EXPECT_EQ(differences.notes.size(), 0u);
  ExpectClose(adjoint.jacobian, differences.jacobian, 1e-5, kDifferenceRounding,
              "adjoint, differences");
  EXPECT_NE(adjoint.jacobian, differences.jacobian);
  if (!HaveJets()) {
    GTEST_SKIP() << "no width of Jets was built";
  }
  const GradientResult implicit =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kJetImplicit));
  ExpectClose(adjoint.jacobian, implicit.jacobian, 1e-9, 1e-13, "adjoint, implicit Jets");
  const GradientResult unrolled =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kJet));
  EXPECT_EQ(unrolled.fallbacks, 0);
  ExpectClose(adjoint.jacobian, unrolled.jacobian, 1e-6, 1e-11, "adjoint, unrolled Jets");
}

TEST(FinalStateJacobian, FreeFallHasTheClosedFormOfTheMap) {
  // y_N = y0 + N h v0 + h² g N (N + 1) / 2, v_N = v0 + N h g.
  const Scene scene = SceneOf(R"({"bodies": [{"name": "a", "mass": 2, "inertia": 1,
      "position": [0, 5], "velocity": [0, 1]}], "simulation": {"dt": 0.125, "duration": 1}})");
  const auto parameters =
      Resolve(scene, {"gravity/y", "bodies/a/position/y", "bodies/a/velocity/y", "bodies/a/mass"});
  for (const auto& [name, method] : kGradientMethodNames) {
    const GradientResult result = FinalStateJacobian(scene, parameters, Method(method));
    if (!result.done && !HaveJets()) {
      continue;
    }
    ASSERT_TRUE(result.done) << result.message;
    ASSERT_EQ(result.outputs[1], "a/y");
    RowMatrixXd expected = RowMatrixXd::Zero(6, 4);
    expected.row(1) << 36.0 / 64.0, 1.0, 1.0, 0.0;
    expected.row(4) << 1.0, 0.0, 1.0, 0.0;
    // The map is linear: differences of values of about 5 err by their rounding over the step.
    EXPECT_LE((result.jacobian - expected).cwiseAbs().maxCoeff(), 1e-9) << name;
    EXPECT_DOUBLE_EQ(result.values[4], 1.0 - 9.81) << name;
  }
}

// A box that slides to the right the whole time: v = v0 − μ g t, μ the mean of both.
constexpr char kSlider[] = R"({"bodies": [
    {"name": "box", "shape": {"box": {"size": [2, 0.2]}}, "mass": 3, "position": [0, 0.1],
     "velocity": [5, 0], "friction": 0.2},
    {"name": "floor", "static": true, "friction": 0.2,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"dt": 0.01, "duration": 0.5}})";

TEST(FinalStateJacobian, SlidingFrictionHasItsClosedForm) {
  const Scene scene = SceneOf(kSlider);
  const auto parameters =
      Resolve(scene, {"bodies/box/friction", "bodies/*/friction", "bodies/box/mass"});
  for (const auto& [name, method] : kGradientMethodNames) {
    const GradientResult result = FinalStateJacobian(scene, parameters, Method(method));
    if (!result.done && !HaveJets()) {
      continue;
    }
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_NEAR(result.jacobian(3, 0), -0.5 * 9.81 * 0.5, 2e-8) << name;
    EXPECT_NEAR(result.jacobian(3, 1), -9.81 * 0.5, 2e-8) << name;
    EXPECT_NEAR(result.jacobian(3, 2), 0.0, 1e-8) << name;
  }
}

TEST(FinalStateJacobian, DifferencesAtTheEndOfARangeAreOneSidedAndSaySo) {
  Scene scene = SceneOf(kSlider);
  scene.bodies[0].friction = 0.0;
  const auto parameters = Resolve(scene, {"bodies/box/friction"});
  const GradientResult result =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kFiniteDifference));
  ASSERT_TRUE(result.done) << result.message;
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0].find("one-sided difference above bodies/box/friction"), 0u);
  EXPECT_NEAR(result.jacobian(3, 0), -0.5 * 9.81 * 0.5, 2e-8);
}

TEST(FinalStateJacobian, DifferencesBelowOneAreOneSidedAndOfSecondOrder) {
  // Two impacts: v is quadratic in e, for which the one-sided formula is exact.
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.6],
       "velocity": [0, -1.3]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "lid", "static": true, "position": [0, 1.5],
       "shape": {"half_plane": {"normal": [0, -1], "offset": 0}}}],
    "pairs": [{"bodies": ["ball", "*"], "restitution": 1}],
    "simulation": {"dt": 0.01, "duration": 0.7}})");
  const auto parameters = Resolve(scene, {"pairs/ball:*/restitution"});
  const GradientResult exact =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kAdjoint));
  const GradientResult result =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kFiniteDifference));
  ASSERT_TRUE(result.done) << result.message;
  ASSERT_GE(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0].find("one-sided difference below"), 0u);
  EXPECT_NEAR(result.values[4], -1.3, 1e-12);
  EXPECT_NEAR(exact.jacobian(4, 0), 2.0 * -1.3, 1e-12);
  EXPECT_NEAR(result.jacobian(4, 0), exact.jacobian(4, 0), 1e-8);
}

TEST(FinalStateJacobian, DifferencesReportChangedModes) {
  const Scene scene = SceneOf(test_scenes::FallingBall(0.05, R"({"dt": 0.01, "duration": 0.11})"));
  GradientOptions options = Method(GradientMethod::kFiniteDifference);
  options.step = 0.02;  // m: lands a step or two earlier or later
  const GradientResult result =
      FinalStateJacobian(scene, Resolve(scene, {"bodies/ball/position/y"}), options);
  ASSERT_TRUE(result.done) << result.message;
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_NE(result.notes[0].find("contacts or modes change"), std::string::npos);
}

TEST(FinalStateJacobian, RecomputedFactorisationsGiveTheSame) {
  const Scene scene = SceneOf(test_scenes::Mixture());
  const auto parameters = Resolve(scene, {"bodies/ball/mass", "bodies/*/friction"});
  GradientOptions options = Method(GradientMethod::kAdjoint);
  const GradientResult kept = FinalStateJacobian(scene, parameters, options);
  options.factorisations = Factorisations::kRecompute;
  options.repeat = 2;  // a tape that is used again
  const GradientResult recomputed = FinalStateJacobian(scene, parameters, options);
  EXPECT_EQ(kept.jacobian, recomputed.jacobian);
  EXPECT_GT(recomputed.seconds, 0.0);
  EXPECT_GT(recomputed.rollout_seconds, 0.0);
}

TEST(LossGradient, IsTheJacobianTimesTheLossesDerivative) {
  const Scene scene = SceneOf(test_scenes::Mixture());
  const auto parameters = Resolve(scene, kMixtureParameters);
  const std::vector<LossTerm> terms = {
      {"ball/x", 1.0, 2.0}, {"rod/angle", 0.3, 1.0}, {"ball/x", 0.5, 1.0}};
  const GradientResult full = FinalStateJacobian(scene, parameters, {});
  VectorX<double> expected = VectorX<double>::Zero(full.jacobian.cols());
  double loss = 0.0;
  for (const LossTerm& term : terms) {
    const Eigen::Index row = term.output == "ball/x" ? 0 : 14;
    ASSERT_EQ(full.outputs[row], term.output);
    const double error = full.values[row] - term.target;
    loss += term.weight * error * error;
    expected += 2.0 * term.weight * error * full.jacobian.row(row).transpose();
  }
  for (const GradientMethod method : {GradientMethod::kAdjoint, GradientMethod::kTangent}) {
    const GradientResult result = LossGradient(scene, parameters, terms, Method(method));
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_NEAR(result.loss, loss, 1e-13 * loss);
    EXPECT_LE((result.gradient - expected).cwiseAbs().maxCoeff(),
              1e-11 * expected.cwiseAbs().maxCoeff());
  }
}

// The rules of MethodOf, each with those before it not applying.
TEST(MethodOf, TakesTheOneThatIsNamedWhateverTheRest) {
  for (const auto& [name, method] : kGradientMethodNames) {
    if (method == GradientMethod::kAuto) continue;
    GradientOptions options = Method(method);
    options.side = DerivativeSide::kPlus;
    EXPECT_EQ(MethodOf(options, Differentiated::kLoss, 100, 6), method) << name;
  }
}

TEST(MethodOf, AutoComparesColumns) {
  const GradientOptions options;
  EXPECT_EQ(options.method, GradientMethod::kAuto);
  const auto method = [&](long parameters, long outputs) {
    return MethodOf(options, Differentiated::kFinalState, parameters, outputs);
  };
  EXPECT_EQ(method(1, 6000), GradientMethod::kTangent);
  EXPECT_EQ(method(6, 6), GradientMethod::kTangent);
  EXPECT_EQ(method(7, 6), GradientMethod::kAdjoint);
}

TEST(MethodOf, AutoTakesTheAdjointOfALoss) {
  EXPECT_EQ(MethodOf({}, Differentiated::kLoss, 1, 6), GradientMethod::kAdjoint);
  EXPECT_EQ(MethodOf({}, Differentiated::kLoss, 100, 6), GradientMethod::kAdjoint);
}

TEST(MethodOf, AutoFollowsOptionsThatOnlyOneMethodHas) {
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    GradientOptions sided{.side = side};
    EXPECT_EQ(MethodOf(sided, Differentiated::kLoss, 100, 6), GradientMethod::kTangent);
    EXPECT_EQ(MethodOf(sided, Differentiated::kFinalState, 100, 6), GradientMethod::kTangent);
    sided.factorisations = Factorisations::kRecompute;  // no other method has sides
    EXPECT_EQ(MethodOf(sided, Differentiated::kFinalState, 1, 6), GradientMethod::kTangent);
  }
  const GradientOptions recomputed{.factorisations = Factorisations::kRecompute};
  EXPECT_EQ(MethodOf(recomputed, Differentiated::kFinalState, 1, 6), GradientMethod::kAdjoint);
  const GradientOptions checkpoints{.checkpointing = {Checkpointing::Kind::kEvery, 10, 0}};
  EXPECT_EQ(MethodOf(checkpoints, Differentiated::kFinalState, 1, 6), GradientMethod::kAdjoint);
}

// The result says which it was, and is that method's bit for bit.
TEST(FinalStateJacobian, AutoIsTheMethodThatItNames) {
  const Scene scene = SceneOf(kSlider);
  const std::vector<std::string> few = {"bodies/box/mass", "gravity/y"};
  const std::vector<std::string> many = {"bodies/box/mass",
                                         "gravity/x",
                                         "gravity/y",
                                         "bodies/box/friction",
                                         "bodies/box/velocity/x",
                                         "bodies/box/angle",
                                         "bodies/box/position/x"};
  for (const auto& paths : {few, many}) {
    const auto parameters = Resolve(scene, paths);
    const GradientResult chosen = FinalStateJacobian(scene, parameters, {});
    ASSERT_TRUE(chosen.done) << chosen.message;
    const GradientMethod expected =
        paths.size() <= 6 ? GradientMethod::kTangent : GradientMethod::kAdjoint;
    EXPECT_EQ(chosen.method, expected);
    EXPECT_EQ(chosen.jacobian, FinalStateJacobian(scene, parameters, Method(expected)).jacobian);
    const GradientResult loss = LossGradient(scene, parameters, {{"box/vx", 1.0, 1.0}}, {});
    ASSERT_TRUE(loss.done) << loss.message;
    EXPECT_EQ(loss.method, GradientMethod::kAdjoint);
  }
}

TEST(FinalStateJacobian, AutoHasSides) {
  const Scene scene = SceneOf(kSlider);
  const GradientResult plus = FinalStateJacobian(scene, Resolve(scene, {"bodies/box/mass"}),
                                                 {.side = DerivativeSide::kPlus});
  ASSERT_TRUE(plus.done) << plus.message;
  EXPECT_EQ(plus.method, GradientMethod::kTangent);
}

TEST(FinalStateJacobian, NotesJointsThatAreOpenAtTheEnd) {
  Scene scene = SceneOf(test_scenes::WhippingChain(0.5));
  const auto parameters = Resolve(scene, {"bodies/a/mass"});
  const GradientResult closed = FinalStateJacobian(scene, parameters, {});
  EXPECT_EQ(closed.open_joint, "");
  scene.simulation.joint_correction = JointCorrection::kNone;
  const GradientResult open = FinalStateJacobian(scene, parameters, {});
  ASSERT_TRUE(open.done) << open.message;
  EXPECT_NE(open.open_joint.find("is open by"), std::string::npos);
  EXPECT_EQ(std::count(open.notes.begin(), open.notes.end(), open.open_joint), 1);
}

TEST(LossGradient, RefusesAnUnknownOutput) {
  const Scene scene = SceneOf(kSlider);
  const GradientResult result = LossGradient(scene, Resolve(scene, {"gravity/y"}), {{"bax/x"}}, {});
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.message.find("bax/x"), std::string::npos);
}

TEST(FinalStateJacobian, RefusesSettingsThatTheEngineLacks) {
  Scene scene = SceneOf(kSlider);
  scene.simulation.integrator = Integrator::kTrapezoidal;
  const GradientResult result = FinalStateJacobian(scene, Resolve(scene, {"gravity/y"}), {});
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.message.find("test.json: /simulation/integrator: "), std::string::npos)
      << result.message;
}

// Projections with a drift of millimetres a step, which multipliers of light links feel.
TEST(GradientTest, AllMethodsAgreeThroughLargeProjections) {
  const Scene scene = SceneOf(test_scenes::WhippingChain(0.5));
  const std::vector<ParameterPath> parameters =
      Resolve(scene, {"gravity/y", "bodies/a/mass", "bodies/c/mass", "joints/i/angle",
                      "joints/j/anchor/x", "bodies/b/position/y"});
  const GradientResult tangent =
      FinalStateJacobian(scene, parameters, Method(GradientMethod::kTangent));
  ASSERT_TRUE(tangent.done) << tangent.message;
  const auto close = [&](GradientMethod method, double tolerance, const std::string& what) {
    const GradientResult other = FinalStateJacobian(scene, parameters, Method(method));
    ASSERT_TRUE(other.done) << other.message;
    EXPECT_EQ(other.fallbacks, 0);
    for (Eigen::Index c = 0; c < tangent.jacobian.cols(); ++c) {
      const double scale = tangent.jacobian.col(c).cwiseAbs().maxCoeff();
      EXPECT_GT(scale, 0.1);
      EXPECT_LE((other.jacobian.col(c) - tangent.jacobian.col(c)).cwiseAbs().maxCoeff(),
                tolerance * scale)
          << what << " parameter " << c;
    }
  };
  close(GradientMethod::kAdjoint, 1e-11, "adjoint");
  close(GradientMethod::kFiniteDifference, 1e-6, "differences");
  if (HaveJets()) {
    close(GradientMethod::kJetImplicit, 1e-10, "implicit");
    close(GradientMethod::kJet, 1e-9, "unrolled");
  }
}

// A program may set what a file may not hold.
TEST(GradientTest, NumbersThatAreNotFiniteAreAnError) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(ParseScene(R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}},
      "mass": 1, "position": [0, 0.1], "velocity": [1, 0], "friction": 0.3}, {"name": "floor",
      "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}]})",
                         "scene", ".", &scene, &error))
      << error;
  const std::vector<ParameterPath> mass = Resolve(scene, {"bodies/ball/mass"});
  EXPECT_TRUE(FinalStateJacobian(scene, mass, {}).done);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    scene.bodies[0].friction = bad;
    const GradientResult result = FinalStateJacobian(scene, mass, {});
    EXPECT_FALSE(result.done);
    EXPECT_NE(result.message.find("bodies/ball/friction: expected a finite number"),
              std::string::npos)
        << result.message;
  }
  // What overflows on the way.
  scene.bodies[0].friction = 0.3;
  scene.bodies[0].position = {1.7e308, 0.1};
  scene.bodies[0].velocity = {1.7e308, 0.0};
  const GradientResult result = FinalStateJacobian(scene, mass, {});
  EXPECT_TRUE(!result.done || (result.values.allFinite() && result.jacobian.allFinite()));
  EXPECT_EQ(result.done, result.message.empty());
}

// 1e-12 kg between a floor and a hinge: what the pivoting method solves well enough is not
// improved by the solves that follow, whose modes must not be left behind.
TEST(GradientTest, ASolutionThatNeedsNoPolishKeepsItsSystem) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(ParseScene(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.4]}}, "mass": 1e-12, "position": [0, 0.2],
       "friction": 0.4, "restitution": 0.3},
      {"name": "bar", "shape": {"box": {"size": [0.6, 0.1]}}, "mass": 0.3, "position": [0.5, 0.45],
       "friction": 0.4, "restitution": 0.3},
      {"name": "floor", "static": true, "friction": 0.4, "restitution": 0.3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "joints": [{"name": "hinge", "type": "revolute", "bodies": ["bar", "box"],
                  "anchor": [0.2, 0.45], "damping": 0.01}],
      "simulation": {"dt": 0.01, "duration": 0.2}})",
                         "scene", ".", &scene, &error))
      << error;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  for (int k = 0; k < 20; ++k) {
    const StepReport report = stepper.Step(model, 0.01 * k, 0.01, &state);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    // Two bodies, a joint, and a block for each closed contact.
    EXPECT_EQ(stepper.system().num_blocks(), 3 + report.closed) << "step " << k;
  }
}

}  // namespace
}  // namespace tangible
