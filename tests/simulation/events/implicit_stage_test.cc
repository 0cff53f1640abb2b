// SPDX-License-Identifier: Apache-2.0
//
// A taut chain with a heavy end: its transverse waves are faster than dt, so that the trapezoidal
// rule's fixed-point iteration does not contract, and Newton's method solves the stages.

#include "tangible/simulation/events/implicit_stage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/scene/scene_json.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

// Four links of 0.1 m and 1 kg, the last of `end` kg; w² = 4 T / (m l).
Scene Chain(double end, double angle, double dt, int steps) {
  std::string bodies, joints;
  for (int i = 0; i < 4; ++i) {
    const std::string n = std::to_string(i), comma = i > 0 ? ", " : "";
    bodies += comma + R"({"name": "link)" + n + R"(", "shape": {"box": {"size": [0.02, 0.1]}},
        "mass": )" +
              (i == 3 ? std::to_string(end) : "1") + R"(, "position": [0, )" +
              std::to_string(-0.1 * (i + 0.5)) + "]}";
    joints += comma + R"({"name": "pin)" + n + R"(", "type": "revolute", "bodies": ["link)" + n +
              R"(", ")" + (i > 0 ? "link" + std::to_string(i - 1) : "world") +
              R"("], "anchor": [0, )" + std::to_string(-0.1 * i) + "]" +
              (i == 0 ? R"(, "angle": )" + std::to_string(angle) : "") + "}";
  }
  Scene scene;
  std::string error;
  EXPECT_TRUE(
      ParseScene(R"({"name": "chain", "bodies": [)" + bodies + R"(], "joints": [)" + joints +
                     R"(], "no_contact": [["link*", "link*"]], "simulation": {"stepping":
      "event", "integrator": "trapezoidal", "joint_correction": "projection", "dt": )" +
                     std::to_string(dt) + R"(, "duration": )" + std::to_string(dt * steps) + "}}",
                 "chain", ".", &scene, &error))
      << error;
  return scene;
}

ParameterPath Path(const Scene& scene, const std::string& path) {
  ParameterPath parameter;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
  return parameter;
}

// B ≈ T τ² / (m l) = 1000 · 9.81 · 1e-4 / 0.1 = 10.
TEST(ImplicitStageTest, AHangingChainHasADerivativeAtLargeSteps) {
  const Scene scene = Chain(1000.0, 0.0, 0.01, 5);
  const std::vector<ParameterPath> parameters = {Path(scene, "gravity/x"),
                                                 Path(scene, "joints/pin0/anchor/x")};
  GradientOptions options;
  options.method = GradientMethod::kTangent;
  const GradientResult tangent = FinalStateJacobian(scene, parameters, options);
  options.method = GradientMethod::kAdjoint;
  const GradientResult adjoint = FinalStateJacobian(scene, parameters, options);
  options.method = GradientMethod::kFiniteDifference;
  const GradientResult differences = FinalStateJacobian(scene, parameters, options);
  ASSERT_TRUE(tangent.done && adjoint.done && differences.done)
      << tangent.message << adjoint.message << differences.message;
  // Gravity swings them, and so does a hinge beside the first one's middle.
  EXPECT_GT(std::abs(tangent.jacobian(0, 1)), 1e-2);
  EXPECT_GT(std::abs(tangent.jacobian(18, 0)), 1e-5);
  const double size = tangent.jacobian.cwiseAbs().maxCoeff();
  EXPECT_LE((adjoint.jacobian - tangent.jacobian).cwiseAbs().maxCoeff(), 1e-9 * size);
  EXPECT_LE((differences.jacobian - tangent.jacobian).cwiseAbs().maxCoeff(), 1e-5 * size);
}

// Of second order through the region where the iteration stops contracting.
TEST(ImplicitStageTest, ASwingingChainIsFollowedAtLargeSteps) {
  const auto angle = [](double dt, int steps) {
    const Scene scene = Chain(100.0, 0.3, dt, steps);
    Model<double> model;
    State<double> first, last;
    BuildModel(scene, &model, &first);
    const RolloutReport report = Rollout(model, first, {}, &last);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    // The report counts where Newton's method was needed.
    if (dt >= 0.02) {
      EXPECT_GE(report.newton_stages, steps);
    } else if (dt <= 0.0005) {
      EXPECT_EQ(report.newton_stages, 0);
    }
    return last.pose[2];
  };
  // B ≈ 100 · 9.81 · dt² / 0.1 = 4 at the largest step, where iteration alone fails.
  const double fine = angle(0.0005, 160);
  const double coarse = std::abs(angle(0.02, 4) - fine), middle = std::abs(angle(0.01, 8) - fine);
  EXPECT_GT(coarse, 0.0);
  EXPECT_LT(coarse, 1e-2);
  EXPECT_LT(middle, 0.5 * coarse);
}

}  // namespace
}  // namespace tangible
