// SPDX-License-Identifier: Apache-2.0
//
// Drag, joint springs and dry friction in joints, Coulomb's and with Stribeck's decay: motions and
// derivatives against closed forms, by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

struct Expected {
  double value = 0.0;
  std::vector<double> derivatives;
};

/// A number of the final state and its derivatives; the other methods agree.
void Expect(const Scene& scene, const std::vector<std::string>& paths, int output,
            const Expected& expected, double tolerance) {
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  EXPECT_NEAR(result.values[output], expected.value, tolerance);
  for (size_t k = 0; k < paths.size(); ++k) {
    EXPECT_NEAR(result.jacobian(output, static_cast<Eigen::Index>(k)), expected.derivatives[k],
                tolerance)
        << paths[k];
  }
  testing::ExpectOthersAgree(scene, paths, result);
}

std::string Simulation(const char* stepping, double dt) {
  return std::string(R"("simulation": {"duration": 1, "stepping": ")") + stepping + R"(", "dt": )" +
         std::to_string(dt) + "}}";
}

// d|v|/dt = −(c/m) |v|²:  v = v_0 / (1 + c |v_0| t / m), along v_0.
TEST(MechanismsTest, DragSlowsAsInTheClosedForm) {
  const std::string body = R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, 0], "velocity": [3, 4],
       "quadratic_drag": 0.5}], )";
  const double q = 1.0 + 0.5 * 5.0 / 2.0;
  const Expected exact = {3.0 / q, {-3.0 * 5.0 / 2.0 / (q * q), 3.0 * 0.5 * 5.0 / 4.0 / (q * q)}};
  const std::vector<std::string> paths = {"bodies/b/quadratic_drag", "bodies/b/mass"};
  Expect(SceneOf(body + Simulation("event", 0.005)), paths, 3, exact, 1e-9);
  // v⁺ = v / (1 + h c |v| / m) is this form's own recursion.
  Expect(SceneOf(body + Simulation("fixed", 0.01)), paths, 3, exact, 1e-13);
}

// At rest the drag has no derivative by its coefficient, and nothing is divided by the speed.
TEST(MechanismsTest, DragOfABodyAtRestIsNothing) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, 0], "quadratic_drag": 0.5}], )") +
                                Simulation(stepping, 0.01));
    Expect(scene, {"bodies/b/quadratic_drag", "bodies/b/velocity/x"}, 3, {0.0, {0.0, 1.0}}, 1e-15);
  }
}

// θ = r + (θ_0 − r) cos(w t), w² = k / (I + m l²).
TEST(MechanismsTest, ASpringAtAHingeSwingsAsInTheClosedForm) {
  const std::string body = R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0, -1]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                "angle": 0.3, "stiffness": 8, "rest_angle": 0.1}], )";
  const double w = std::sqrt(8.0 / 2.1);
  const Expected exact = {0.1 + 0.2 * std::cos(w),
                          {-0.2 * std::sin(w) * w / 16.0, 1.0 - std::cos(w), std::cos(w)}};
  const std::vector<std::string> paths = {"joints/h/stiffness", "joints/h/rest_angle",
                                          "joints/h/angle"};
  Expect(SceneOf(body + Simulation("event", 0.005)), paths, 2, exact, 1e-9);
  Expect(SceneOf(body + Simulation("fixed", 0.0002)), paths, 2, exact, 1e-3);
}

// x = x_0 cos(w t) about the rest, between two bodies: the reduced mass.
TEST(MechanismsTest, ASpringAtASliderMovesBothBodies) {
  const std::string bodies = R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.1, "position": [0.5, 0]},
      {"name": "b", "mass": 3, "inertia": 0.1, "position": [0, 0]}],
    "joints": [{"name": "s", "type": "prismatic", "bodies": ["a", "b"], "anchor": [0.5, 0],
                "axis": [1, 0], "stiffness": 6, "rest_displacement": -0.2}], )";
  const double w = std::sqrt(6.0 / 1.2);
  // The centre of mass stays; a moves by 3/5 of the displacement d = −0.2 + 0.2 cos(w t).
  const Expected exact = {0.5 + 0.6 * 0.2 * (std::cos(w) - 1.0),
                          {-0.6 * 0.2 * std::sin(w) * w / 12.0, 0.6 * (1.0 - std::cos(w))}};
  const std::vector<std::string> paths = {"joints/s/stiffness", "joints/s/rest_displacement"};
  Expect(SceneOf(bodies + Simulation("event", 0.005)), paths, 0, exact, 1e-9);
}

// A wheel on a hinge with dry friction M:  ω = ω_0 − M t / I until it stops, at θ = I ω_0² / (2 M).
TEST(MechanismsTest, FrictionAtAHingeStopsAWheel) {
  const auto wheel = [](const char* stepping, double dt, double friction) {
    return SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                "rate": 2, "friction": )" +
                   std::to_string(friction) + "}], " + Simulation(stepping, dt));
  };
  const std::vector<std::string> paths = {"joints/h/friction", "joints/h/rate", "bodies/b/inertia"};
  const Expected slows = {2.0 - 0.6 / 0.5, {-1.0 / 0.5, 1.0, 0.6 / 0.25}};
  const Expected stops = {0.5 * 4.0 / 3.0, {-0.5 * 4.0 / 4.5, 2.0 / 3.0, 4.0 / 3.0}};
  Expect(wheel("event", 0.1, 0.6), paths, 5, slows, 1e-13);
  Expect(wheel("fixed", 0.1, 0.6), paths, 5, slows, 1e-13);
  // It stops after 2/3 s, within a step.
  Expect(wheel("event", 0.1, 1.5), paths, 2, stops, 1e-12);
  Expect(wheel("fixed", 0.001, 1.5), paths, 2, stops, 5e-3);
}

// The friction F(ω) = F_k + (F_s − F_k) exp(−(ω / ω_s)²) slows a wheel: the time
//   t = I ∫ dω / F(ω)  over [ω_1, ω_0]
// gives ω_1, found by Newton's method on Simpson's rule; at fixed t, with the same integral,
//   ∂ω_1/∂ω_0 = F(ω_1) / F(ω_0),  ∂ω_1/∂p = −F(ω_1) ∫ (∂F/∂p) / F² dω,  ∂ω_1/∂I = −F(ω_1) t / I².
struct DecayingFriction {
  double at_rest = 1.5, kinetic = 0.4, speed = 1.2, inertia = 0.5;

  double At(double omega) const {
    return kinetic + (at_rest - kinetic) * std::exp(-std::pow(omega / speed, 2));
  }
  template <typename F>
  static double Integral(double from, double to, const F& f) {
    constexpr int kHalves = 2000;
    const double h = (to - from) / (2 * kHalves);
    double sum = f(from) + f(to);
    for (int i = 1; i < 2 * kHalves; ++i) sum += (i % 2 == 1 ? 4.0 : 2.0) * f(from + i * h);
    return sum * h / 3.0;
  }
  double After(double omega, double t) const {
    double end = omega;
    for (int k = 0; k < 50; ++k) {
      const double took = inertia * Integral(end, omega, [&](double w) { return 1.0 / At(w); });
      end += (took - t) * At(end) / inertia;
    }
    return end;
  }
  /// By the friction at rest, the kinetic friction, Stribeck's speed, the first speed, the inertia.
  std::vector<double> Derivatives(double omega, double t) const {
    const double end = After(omega, t);
    const auto decayed = [&](double w) { return std::exp(-std::pow(w / speed, 2)); };
    const auto by = [&](const auto& slope) {
      return -At(end) *
             Integral(end, omega, [&](double w) { return slope(w) / std::pow(At(w), 2); });
    };
    const double by_speed = by([&](double w) {
      return (at_rest - kinetic) * decayed(w) * 2.0 * w * w / std::pow(speed, 3);
    });
    return {by(decayed), by([&](double w) { return 1.0 - decayed(w); }), by_speed,
            At(end) / At(omega), At(end) * t / (inertia * inertia)};
  }
};

// A wheel that slows by friction with Stribeck's decay, either way round, while it turns; and once
// it stands, at the angle where it stopped.
TEST(MechanismsTest, DecayingFrictionSlowsAWheel) {
  const DecayingFriction friction;
  const std::vector<std::string> paths = {"joints/h/friction", "joints/h/kinetic_friction",
                                          "joints/h/stribeck_speed", "joints/h/rate",
                                          "bodies/b/inertia"};
  const auto wheel = [&](double rate) {
    return SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                "friction": 1.5, "kinetic_friction": 0.4, "stribeck_speed": 1.2, "rate": )" +
                   std::to_string(rate) + "}], " + Simulation("event", 0.002));
  };
  Expected slows = {friction.After(3.0, 1.0), friction.Derivatives(3.0, 1.0)};
  Expect(wheel(3.0), paths, 5, slows, 1e-10);
  slows.value = -slows.value;
  for (size_t k : {0, 1, 2, 4}) slows.derivatives[k] = -slows.derivatives[k];
  Expect(wheel(-3.0), paths, 5, slows, 1e-10);
  // θ = I ∫ ω dω / F(ω) over [0, ω_0], whose derivatives follow under the integral.
  const auto stops_at = [&](const auto& slope) {
    return DecayingFriction::Integral(0.0, 1.0, slope);
  };
  Expected stops;
  stops.value = friction.inertia * stops_at([&](double w) { return w / friction.At(w); });
  const auto by = [&](const auto& slope) {
    return -friction.inertia *
           stops_at([&](double w) { return w * slope(w) / std::pow(friction.At(w), 2); });
  };
  const auto decayed = [](double w) { return std::exp(-std::pow(w / 1.2, 2)); };
  stops.derivatives = {by(decayed), by([&](double w) { return 1.0 - decayed(w); }),
                       by([&](double w) { return 1.1 * decayed(w) * 2.0 * w * w / 1.728; }),
                       0.5 / friction.At(1.0), stops.value / 0.5};
  Expect(wheel(1.0), paths, 2, stops, 1e-9);
}

// A slider pulled along by a spring whose far end moves: it sticks, breaks loose at the friction at
// rest, and sticks again below it, several times (stick-slip), and the methods agree.
TEST(MechanismsTest, DecayingFrictionSticksAndSlips) {
  const Scene scene = SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "b", "mass": 1, "inertia": 0.1, "position": [0, 0]},
      {"name": "hand", "kinematic": true, "position": [1, 0], "velocity": [0.5, 0]}],
    "joints": [{"name": "s", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                "axis": [1, 0.2], "friction": 5, "kinetic_friction": 2, "stribeck_speed": 0.3}],
    "springs": [{"name": "pull", "bodies": ["hand", "b"], "anchors": [[1, 0], [0, 0]],
                 "stiffness": 40, "rest_length": 1}],
    "simulation": {"duration": 2, "dt": 0.005, "stepping": "event"}})");
  const std::vector<std::string> paths = {"joints/s/friction",       "joints/s/kinetic_friction",
                                          "joints/s/stribeck_speed", "springs/pull/stiffness",
                                          "joints/s/axis/y",         "bodies/b/mass",
                                          "bodies/hand/velocity/x"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  testing::ExpectOthersAgree(scene, paths, result);
}

// A force below the limit moves nothing, to the bit, and no parameter changes that; once it exceeds
// the limit, the slider accelerates by the difference.
TEST(MechanismsTest, FrictionAtASliderHoldsUpToItsLimit) {
  const auto slider = [](const char* stepping, double force) {
    return SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
    "joints": [{"name": "s", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                "axis": [1, 0], "friction": 3, "effort": )" +
                   std::to_string(force) + "}], " + Simulation(stepping, 0.01));
  };
  const std::vector<std::string> paths = {"joints/s/friction", "joints/s/effort", "bodies/b/mass"};
  for (const char* stepping : {"fixed", "event"}) {
    Expect(slider(stepping, 2.9), paths, 0, {0.0, {0.0, 0.0, 0.0}}, 1e-15);
    Expect(slider(stepping, -2.9), paths, 3, {0.0, {0.0, 0.0, 0.0}}, 1e-15);
    Expect(slider(stepping, 5.0), paths, 3, {1.0, {-0.5, 0.5, -0.5}}, 1e-13);
    Expect(slider(stepping, -5.0), paths, 3, {-1.0, {0.5, 0.5, 0.5}}, 1e-13);
  }
}

// Each half swing of a spring k with dry friction F loses 2 F / k of its amplitude (Lorenz 1924;
// Den Hartog, Mechanical Vibrations, sec. 8.3): after three of them x = −(x_0 − 6 F / k).
TEST(MechanismsTest, FrictionTakesItsShareOfEachHalfSwing) {
  const double k = 9.0 * M_PI * M_PI * 2.0;  // three half swings in the second that it runs
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
    "joints": [{"name": "s", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                "axis": [1, 0], "displacement": 1, "friction": 4, "stiffness": )" +
                              std::to_string(k) + "}], " + Simulation("event", 0.002));
  const std::vector<std::string> paths = {"joints/s/friction", "joints/s/displacement"};
  // The last half swing ends with the run, where the velocity's derivatives jump; not the place's.
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[0], -(1.0 - 24.0 / k), 1e-8);
  EXPECT_NEAR(result.jacobian(0, 0), 6.0 / k, 1e-8);
  EXPECT_NEAR(result.jacobian(0, 1), -1.0, 1e-8);
}

// Both links of a double pendulum come to rest in their hinges, at different times, and a link that
// had stuck is torn loose again: derivatives by every method, and by differences.
TEST(MechanismsTest, FrictionBetweenLinks) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "a", "shape": {"box": {"size": [1, 0.1]}}, "mass": 2, "position": [0.5, 0]},
      {"name": "b", "shape": {"box": {"size": [0.8, 0.1]}}, "mass": 1, "position": [1.4, 0]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "friction": 0.6, "angle": -1},
               {"name": "k", "type": "revolute", "bodies": ["b", "a"], "anchor": [1, 0],
                "friction": 0.4, "rate": 2}],
    "simulation": {"duration": 6, "dt": 0.01, "stepping": ")" +
                                std::string(stepping) + "\"}}");
    const std::vector<std::string> paths = {"joints/h/friction", "joints/k/friction",
                                            "joints/k/rate", "bodies/b/mass"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    // The friction turns back, which fixed steps do not follow.
    const bool of_map = std::string(stepping) == "fixed";
    EXPECT_EQ(result.certificate.verdict,
              std::string(of_map ? "of the discrete map: " : "") + "trustworthy");
    testing::ExpectOthersAgree(scene, paths, result);
    const GradientResult differences = Jacobian(scene, paths, GradientMethod::kFiniteDifference);
    EXPECT_LT((result.jacobian - differences.jacobian).cwiseAbs().maxCoeff(), 1e-6);
  }
}

// A link that is released from rest, and falls in spite of its friction: a change of its rate to
// the other side is braked from that side first. So is one of a twist that the joints turn into it.
TEST(MechanismsTest, FrictionAtRestHasTwoSides) {
  const Scene scene = SceneOf(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "a", "shape": {"box": {"size": [1, 0.1]}}, "mass": 2, "position": [0.5, 0]},
      {"name": "b", "shape": {"box": {"size": [0.8, 0.1]}}, "mass": 1, "position": [1.4, 0]}],
    "joints": [{"name": "h", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "friction": 0.6, "angle": -1},
               {"name": "k", "type": "revolute", "bodies": ["b", "a"], "anchor": [1, 0],
                "rate": 2}], )" +
                              Simulation("event", 0.01));
  const auto verdict = [&](const char* path) {
    return Jacobian(scene, {path}, GradientMethod::kTangent).certificate.verdict;
  };
  EXPECT_EQ(verdict("joints/h/friction"), "trustworthy");
  EXPECT_EQ(verdict("joints/k/rate"), "trustworthy");
  EXPECT_EQ(verdict("bodies/b/mass"), "trustworthy");
  EXPECT_EQ(verdict("joints/h/rate").rfind("near a kink", 0), 0u);
  EXPECT_EQ(verdict("bodies/b/velocity/y").rfind("near a kink", 0), 0u);
}

}  // namespace
}  // namespace tangible
