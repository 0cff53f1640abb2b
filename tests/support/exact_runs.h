// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs by events whose final states and derivatives are those of closed forms, by all methods and
// from both sides, for steps that divide the events' times and for steps that do not.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gradients.h"
#include "sanitizers.h"
#include "scenes.h"

namespace tangible::exact_runs {

// A value of the final state and its derivatives. Values are sums of a few hundred steps, whose
// rounding is below 1e-12; a step that is late by one is wrong by 1e-4 or more.
struct Exact {
  int row = 0;
  double value = 0.0;
  std::vector<double> derivatives;
};
inline constexpr double kOfValue = 1e-9;
inline constexpr double kOfDerivative = 1e-8;
inline constexpr double kOfDifferences = 2e-5;  // differences of second order with steps of 6e-6

inline std::string Floor(double friction) {
  return R"({"name": "floor", "static": true, "restitution": 0.5, "friction": )" +
         std::to_string(friction) + R"(, "shape": {"half_plane": {"normal": [0, 1]}}})";
}

inline std::string Box(const std::string& name, double x, double v, double friction) {
  return R"({"name": ")" + name + R"(", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1,
      "position": [)" +
         std::to_string(x) + R"(, 0.05], "velocity": [)" + std::to_string(v) +
         R"(, 0], "friction": )" + std::to_string(friction) + "}";
}

inline std::string Disc(const std::string& name, double x, double y, double v, double friction) {
  return R"({"name": ")" + name + R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
      "restitution": 0.5, "position": [)" +
         std::to_string(x) + ", " + std::to_string(y) + R"(], "velocity": [)" + std::to_string(v) +
         R"(, 0], "friction": )" + std::to_string(friction) + "}";
}

inline Scene Of(const std::string& gravity, const std::string& bodies, double duration,
                const std::string& more = "") {
  return test_scenes::SceneOf(R"({"gravity": )" + gravity + R"(, "bodies": [)" + bodies + "]" +
                              more +
                              R"(, "simulation": {"stepping": "event", "dt": 0.01, "duration": )" +
                              std::to_string(duration) + "}}");
}

// The scene with a force on its body b that grows from `start` by `slope` N/s along x or y.
inline Scene WithRamp(Scene scene, double start, double slope, bool up) {
  Signal ramp;
  ramp.interpolation = Signal::Interpolation::kLinear;
  ramp.time = {0.0, 10.0};
  ramp.x = {up ? 0.0 : start, up ? 0.0 : start + 10.0 * slope};
  ramp.y = {up ? start : 0.0, up ? start + 10.0 * slope : 0.0};
  scene.forces[0].force_signal = ramp;
  return scene;
}
inline constexpr char kForce[] = R"(, "forces": [{"name": "f", "body": "b", "force": [0, 0]}])";

inline void ExpectRows(const GradientResult& result, const std::vector<Exact>& exact,
                       double tolerance, const std::string& what) {
  ASSERT_TRUE(result.done) << what << ": " << result.message;
  EXPECT_EQ(result.certificate.verdict, "trustworthy") << what;
  for (const Exact& e : exact) {
    EXPECT_NEAR(result.values[e.row], e.value, kOfValue) << what << ", row " << e.row;
    for (size_t k = 0; k < e.derivatives.size(); ++k) {
      EXPECT_NEAR(result.jacobian(e.row, static_cast<Eigen::Index>(k)), e.derivatives[k],
                  tolerance * std::max(1.0, std::abs(e.derivatives[k])))
          << what << ", row " << e.row << ", parameter " << k;
    }
  }
}

// By every method and from both sides, with steps of which most divide 0.5.
inline void ExpectExact(Scene scene, const std::vector<std::string>& paths,
                        const std::vector<Exact>& exact,
                        const std::vector<double>& steps = {0.5, 0.25, 0.1, 0.02, 0.01, 0.03,
                                                            0.007}) {
  std::vector<GradientMethod> methods = {GradientMethod::kAdjoint, GradientMethod::kTangent,
                                         GradientMethod::kFiniteDifference};
  if (tangible::testing::HaveJets()) {
    methods.push_back(GradientMethod::kJetImplicit);
    methods.push_back(GradientMethod::kJet);
  }
  for (const double dt : steps) {
    if (tangible::testing::kSanitized && dt < 0.2 * steps[0]) continue;
    scene.simulation.dt = dt;
    const std::string with = ", dt " + std::to_string(dt);
    for (const GradientMethod method : methods) {
      ExpectRows(tangible::testing::JacobianOf(scene, paths, method), exact,
                 method == GradientMethod::kFiniteDifference ? kOfDifferences : kOfDerivative,
                 "method " + std::to_string(static_cast<int>(method)) + with);
    }
    for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
      ExpectRows(FinalStateJacobian(scene, tangible::testing::Resolve(scene, paths),
                                    {.method = GradientMethod::kTangent, .side = side}),
                 exact, kOfDerivative, (side == DerivativeSide::kPlus ? "plus" : "minus") + with);
    }
  }
}

}  // namespace tangible::exact_runs
