// SPDX-License-Identifier: Apache-2.0
//
// Couplings of joints, kept and limited: motions and derivatives against closed forms, by every
// method.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

struct CoupledMotion {
  double value = 0.0;
  std::vector<std::string> paths;
  std::vector<double> derivatives;
};

/// A number of the final state and its derivatives; the other methods agree.
void ExpectMotion(const std::string& mechanism, const char* stepping, double dt, int output,
                  const CoupledMotion& exact) {
  const Scene scene = SceneOf(mechanism + R"(, "simulation": {"duration": 1, "stepping": ")" +
                              stepping + R"(", "dt": )" + std::to_string(dt) + "}}");
  const GradientResult result = testing::Jacobian(scene, exact.paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  EXPECT_NEAR(result.values[output], exact.value, 1e-9) << stepping;
  for (size_t k = 0; k < exact.paths.size(); ++k) {
    EXPECT_NEAR(result.jacobian(output, static_cast<Eigen::Index>(k)), exact.derivatives[k], 1e-9)
        << exact.paths[k] << ' ' << stepping;
  }
  testing::ExpectOthersAgree(scene, exact.paths, result);
}

// Wheels of inertia I_1, I_2 with ω_1 + r ω_2 = 0 and a torque T on the first. Where rates and
// ratio change on their own, the momentum along the motion that the coupling allows is kept:
//   J ω_1 = I_1 w_1 − I_2 w_2 / r + T t,    J = I_1 + I_2 / r².
TEST(CouplingsTest, AGearTrainTurnsAsInTheClosedForm) {
  const double i1 = 0.5, i2 = 0.2, r = 2.0, torque = 0.7, w1 = 1.0, w2 = -0.5;
  const std::string gears = R"({"gravity": [0, -9.81], "bodies": [
      {"name": "first", "mass": 2, "inertia": 0.5, "position": [0, 0]},
      {"name": "second", "mass": 1, "inertia": 0.2, "position": [1, 0]}],
    "joints": [
      {"name": "gear", "type": "coupling", "joints": ["a", "b"], "ratio": 2},
      {"name": "a", "type": "revolute", "bodies": ["first", "world"], "anchor": [0, 0], "rate": 1,
       "effort": 0.7},
      {"name": "b", "type": "revolute", "bodies": ["second", "world"], "anchor": [1, 0],
       "rate": -0.5}])";
  const double inertia = i1 + i2 / (r * r);
  const double omega = (i1 * w1 - i2 * w2 / r + torque) / inertia;
  const CoupledMotion exact = {
      omega,
      {"joints/a/effort", "bodies/first/inertia", "bodies/second/inertia", "joints/gear/ratio",
       "joints/a/rate", "joints/b/rate"},
      {1.0 / inertia, (w1 - omega) / inertia, (-w2 / r - omega / (r * r)) / inertia,
       (i2 * w2 / (r * r) + omega * 2.0 * i2 / (r * r * r)) / inertia, i1 / inertia,
       -i2 / r / inertia}};
  ExpectMotion(gears, "event", 0.05, 5, exact);
  ExpectMotion(gears, "fixed", 0.01, 5, exact);
}

// A rack of mass m falls and turns a pinion, y + R θ = 0:  ÿ = −m g / (m + I / R²). The joint of
// the rack is beside its centre of mass, and the pinion is the second body of its joint.
TEST(CouplingsTest, ARackTurnsAPinion) {
  const std::string rack = R"({"gravity": [0, -10], "bodies": [
      {"name": "rack", "mass": 2, "inertia": 0.3, "position": [0, 0]},
      {"name": "pinion", "mass": 1, "inertia": 0.09, "position": [0.5, 0]},
      {"name": "frame", "static": true, "position": [0.5, 0], "angle": 0.4}],
    "joints": [
      {"name": "rail", "type": "prismatic", "bodies": ["rack", "frame"], "anchor": [0.1, 0.2],
       "axis": [0, 2]},
      {"name": "pin", "type": "revolute", "bodies": ["frame", "pinion"], "anchor": [0.5, 0]},
      {"name": "teeth", "type": "coupling", "joints": ["rail", "pin"], "ratio": -0.3}])";
  const double m = 2.0, inertia = 0.09, radius = 0.3, g = 10.0;
  const double sum = m + inertia / (radius * radius);
  const double a = -m * g / sum;
  const CoupledMotion exact = {
      a,
      {"bodies/rack/mass", "bodies/pinion/inertia", "joints/teeth/ratio", "gravity/y"},
      {-g / sum - a / sum, -a / (radius * radius) / sum,
       -a * 2.0 * inertia / (radius * radius * radius) / sum, m / sum}};
  ExpectMotion(rack, "event", 0.05, 4, exact);
  ExpectMotion(rack, "fixed", 0.01, 4, exact);
}

// Two weights on the rope of a pulley, y_1 + y_2 = 0:  ÿ_1 = −g (m_1 − m_2) / (m_1 + m_2).
TEST(CouplingsTest, APulleyCarriesTwoWeights) {
  const std::string pulley = R"({"gravity": [0, -10], "bodies": [
      {"name": "left", "mass": 3, "inertia": 0.1, "position": [0, 0]},
      {"name": "right", "mass": 1, "inertia": 0.1, "position": [1, 0.5]}],
    "joints": [
      {"name": "l", "type": "prismatic", "bodies": ["left", "world"], "anchor": [0, 0],
       "axis": [0, 1]},
      {"name": "r", "type": "prismatic", "bodies": ["right", "world"], "anchor": [1, 0.5],
       "axis": [0, 1]},
      {"name": "pulley", "type": "coupling", "joints": ["l", "r"], "ratio": 1}])";
  const CoupledMotion place = {
      -2.5, {"bodies/left/mass", "bodies/right/mass", "gravity/y"}, {-0.625, 1.875, 0.25}};
  ExpectMotion(pulley, "event", 0.05, 1, place);
  const CoupledMotion speed = {
      -5.0, {"bodies/left/mass", "bodies/right/mass", "gravity/y"}, {-1.25, 3.75, 0.5}};
  ExpectMotion(pulley, "fixed", 0.01, 4, speed);
}

// Atwood's machine: two weights hang on one rope over a fixed pulley, whose ends are distance
// joints of any length:  ÿ_1 = −g (m_1 − m_2) / (m_1 + m_2).
std::string Atwood(const std::string& velocity, const std::string& limits) {
  return R"({"gravity": [0, -10], "bodies": [
      {"name": "left", "mass": 3, "inertia": 0.1, "position": [0, 0], "velocity": [0, )" +
         velocity + R"(]},
      {"name": "right", "mass": 1, "inertia": 0.1, "position": [1, 0.5]}],
    "joints": [
      {"name": "rope", "type": "coupling", "joints": ["l", "r"], "ratio": 1)" +
         limits + R"(},
      {"name": "l", "type": "distance", "bodies": ["left", "world"], "anchors": [[0, 0], [0, 9]],
       "limits": [0, null]},
      {"name": "r", "type": "distance", "bodies": ["world", "right"], "anchors": [[1, 8], [1, 0.5]],
       "limits": [0, null]}])";
}

TEST(CouplingsTest, AtwoodsMachineFallsAsInTheClosedForm) {
  const CoupledMotion place = {
      -2.5, {"bodies/left/mass", "bodies/right/mass", "gravity/y"}, {-0.625, 1.875, 0.25}};
  ExpectMotion(Atwood("0", ""), "event", 0.05, 1, place);
  const CoupledMotion speed = {
      -5.0, {"bodies/left/mass", "bodies/right/mass", "gravity/y"}, {-1.25, 3.75, 0.5}};
  ExpectMotion(Atwood("0", ""), "fixed", 0.01, 4, speed);
  // Pulled by the whole weight from its start, a rope that may go slack stays taut.
  ExpectMotion(Atwood("0", R"(, "limits": [null, 0])"), "event", 0.05, 1, place);
}

// The heavy weight is thrown up at v and the rope goes slack. It is taut again where
// v t − g t² = −d, at t*; then an impulse J makes its ends move alike, and the weights go on as
// above:
//   y(T) = v t* − ½ g t*² + u τ + ½ a τ²,  τ = T − t*,  u = v − g t* + J / m_1.
TEST(CouplingsTest, ASlackRopeBecomesTaut) {
  const double g = 10.0, v = 4.0, d = 0.2, m1 = 3.0, m2 = 1.0;
  const auto place = [](const double x[5]) {
    const double left = x[0], right = x[1], speed = x[2], slack = x[3], weight = -x[4];
    const double taut = (speed + std::sqrt(speed * speed + 4.0 * weight * slack)) / (2.0 * weight);
    const double impulse = -(speed - 2.0 * weight * taut) / (1.0 / left + 1.0 / right);
    const double after = speed - weight * taut + impulse / left;
    const double rest = 1.0 - taut;
    return speed * taut - 0.5 * weight * taut * taut + after * rest -
           0.5 * weight * (left - right) / (left + right) * rest * rest;
  };
  const double at[5] = {m1, m2, v, d, -g};
  CoupledMotion exact = {place(at),
                         {"bodies/left/mass", "bodies/right/mass", "bodies/left/velocity/y",
                          "joints/rope/limits/1", "gravity/y"},
                         {}};
  for (int k = 0; k < 5; ++k) {
    double up[5], down[5];
    std::copy_n(at, 5, up);
    std::copy_n(at, 5, down);
    up[k] += 1e-5;
    down[k] -= 1e-5;
    exact.derivatives.push_back((place(up) - place(down)) / 2e-5);
  }
  ExpectMotion(Atwood("4", R"(, "limits": [null, 0.2])"), "event", 0.05, 1, exact);
}

// A ring on a string between two pins moves on an ellipse, at a constant speed where no other force
// acts.
TEST(CouplingsTest, ARingOnAStringMovesOnAnEllipse) {
  const std::string string = R"({"gravity": [0, 0], "bodies": [
      {"name": "ring", "mass": 2, "inertia": 0.1, "position": [0, 0.8], "velocity": [1.5, 0]}],
    "joints": [
      {"name": "p", "type": "distance", "bodies": ["ring", "world"],
       "anchors": [[0, 0.8], [-0.6, 0]], "limits": [0, null]},
      {"name": "q", "type": "distance", "bodies": ["world", "ring"],
       "anchors": [[0.6, 0], [0, 0.8]], "limits": [0, null]},
      {"name": "string", "type": "coupling", "joints": ["p", "q"], "ratio": 1}],
    "simulation": {"duration": 2, "stepping": "event", "dt": 0.005}})";
  const std::vector<std::string> paths = {"bodies/ring/velocity/x", "bodies/ring/mass",
                                          "bodies/ring/position/y", "joints/p/anchors/1/x"};
  const GradientResult result = testing::Jacobian(SceneOf(string), paths, GradientMethod::kAdjoint);
  const VectorX<double>& end = result.values;
  EXPECT_NEAR(std::hypot(end[0] + 0.6, end[1]) + std::hypot(end[0] - 0.6, end[1]), 2.0, 1e-10);
  EXPECT_NEAR(std::hypot(end[3], end[4]), 1.5, 1e-7);
  EXPECT_LT(end[1], 0.7);  // it has gone some way
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  testing::ExpectOthersAgree(SceneOf(string), paths, result);
}

// An arm that turns drives a slider along itself, θ + r x = 0: with ρ its distance,
//   (I + m ρ² + m / r²) ω² is kept,  and the place of the slider is ρ (cos θ, sin θ).
TEST(CouplingsTest, AnArmDrivesASliderOnItself) {
  const std::string arm = R"({"gravity": [0, 0], "bodies": [
      {"name": "arm", "mass": 2, "inertia": 0.5, "position": [0, 0]},
      {"name": "slider", "mass": 3, "inertia": 0.2, "position": [1, 0]}],
    "joints": [
      {"name": "hinge", "type": "revolute", "bodies": ["arm", "world"], "anchor": [0, 0],
       "rate": 1.2},
      {"name": "rail", "type": "prismatic", "bodies": ["slider", "arm"], "anchor": [1, 0],
       "axis": [1, 0], "rate": 0.3},
      {"name": "screw", "type": "coupling", "joints": ["hinge", "rail"], "ratio": -4}])";
  for (const char* stepping : {"event", "fixed"}) {
    const Scene scene = SceneOf(arm + R"(, "simulation": {"duration": 1, "stepping": ")" +
                                stepping + R"(", "dt": 0.01}})");
    const std::vector<std::string> paths = {"joints/screw/ratio", "bodies/slider/mass",
                                            "bodies/arm/inertia", "joints/rail/rate"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double theta = result.values[2], omega = result.values[5];
    const double distance = std::hypot(result.values[6], result.values[7]);
    if (stepping == std::string("event")) {
      EXPECT_NEAR(distance, 1.0 + theta / 4.0, 1e-10);
      EXPECT_NEAR((0.7 + 3.0 * (distance * distance + 1.0 / 16.0)) * omega * omega,
                  (0.7 + 3.0 * (1.0 + 1.0 / 16.0)) * 1.2 * 1.2, 1e-7);
    } else {
      EXPECT_NEAR(distance, 1.0 + theta / 4.0, 0.02);  // first order in dt
    }
    EXPECT_GT(theta, 1.0);
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

// A planet on a carrier meshes with a sun, (ω_s − ω_c) + ρ (ω_p − ω_c) = 0: three bodies. A torque
// T between sun and carrier gives, with s = ω_s − ω_c and c = ω_c:
//   [I_s + I_p / ρ²,  I_s − I_p / ρ;  I_s − I_p / ρ,  I_s + I_c + m d² + I_p] [ṡ; ċ] = [T; 0].
TEST(CouplingsTest, APlanetGoesRoundASun) {
  const std::string gears = R"({"gravity": [0, 0], "bodies": [
      {"name": "sun", "mass": 2, "inertia": 0.5, "position": [0, 0]},
      {"name": "carrier", "mass": 1, "inertia": 0.4, "position": [0, 0]},
      {"name": "planet", "mass": 1.5, "inertia": 0.2, "position": [0.6, 0]}],
    "joints": [
      {"name": "hub", "type": "revolute", "bodies": ["carrier", "world"], "anchor": [0, 0]},
      {"name": "axle", "type": "revolute", "bodies": ["sun", "carrier"], "anchor": [0, 0],
       "effort": 0.7},
      {"name": "pin", "type": "revolute", "bodies": ["planet", "carrier"], "anchor": [0.6, 0]},
      {"name": "mesh", "type": "coupling", "joints": ["axle", "pin"], "ratio": 0.5}])";
  const auto sun_speed = [](double is, double ip, double rho, double torque) {
    const double a = is + ip / (rho * rho), b = is - ip / rho;
    const double d = is + 0.4 + 1.5 * 0.36 + ip;
    const double s = torque * d / (a * d - b * b), c = -torque * b / (a * d - b * b);
    return s + c;
  };
  CoupledMotion exact = {
      sun_speed(0.5, 0.2, 0.5, 0.7),
      {"bodies/sun/inertia", "bodies/planet/inertia", "joints/mesh/ratio", "joints/axle/effort"},
      {}};
  const double at[4] = {0.5, 0.2, 0.5, 0.7};
  for (int k = 0; k < 4; ++k) {
    const auto beside = [&](double shift) {
      double x[4];
      std::copy_n(at, 4, x);
      x[k] += shift;
      return sun_speed(x[0], x[1], x[2], x[3]);
    };
    const double h = 2e-4;
    exact.derivatives.push_back(
        (8.0 * (beside(h) - beside(-h)) - beside(2.0 * h) + beside(-2.0 * h)) / (12.0 * h));
  }
  ExpectMotion(gears, "event", 0.01, 5, exact);
}

// Four bodies, two on each hinge: with q = θ_a − θ_b and 1 / J = 1 / I_a + 1 / I_b of each hinge,
//   (J_1 + J_2 / r²) q̈_1 = T,   ω_a = q̇_1 I_b / (I_a + I_b).
TEST(CouplingsTest, TwoHingesOfFourBodies) {
  const std::string hinges = R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [0, 0]},
      {"name": "b", "mass": 1, "inertia": 0.3, "position": [0, 0]},
      {"name": "c", "mass": 1.5, "inertia": 0.2, "position": [1, 0]},
      {"name": "d", "mass": 1.5, "inertia": 0.4, "position": [1, 0]}],
    "joints": [
      {"name": "p", "type": "revolute", "bodies": ["a", "b"], "anchor": [0, 0], "effort": 0.7},
      {"name": "q", "type": "revolute", "bodies": ["c", "d"], "anchor": [1, 0]},
      {"name": "belt", "type": "coupling", "joints": ["p", "q"], "ratio": -1.6}])";
  const double j1 = 0.5 * 0.3 / 0.8, j2 = 0.2 * 0.4 / 0.6, r = -1.6;
  const double speed = 0.7 / (j1 + j2 / (r * r)) * 0.3 / 0.8;
  const CoupledMotion exact = {speed,
                               {"joints/p/effort", "joints/belt/ratio"},
                               {speed / 0.7, speed / (j1 + j2 / (r * r)) * 2.0 * j2 / (r * r * r)}};
  ExpectMotion(hinges, "event", 0.05, 5, exact);
  ExpectMotion(hinges, "fixed", 0.01, 5, exact);
}

// A rope from a weight over a swinging pulley to another one: its length stays, and so does the
// energy.
TEST(CouplingsTest, ARopeOverAPulleyThatSwings) {
  for (const char* stepping : {"event", "fixed"}) {
    const Scene scene = SceneOf(std::string(R"({"gravity": [0, -10], "bodies": [
        {"name": "left", "mass": 1, "inertia": 0.1, "position": [-0.5, -1.2]},
        {"name": "right", "mass": 1.3, "inertia": 0.1, "position": [0.7, -1]},
        {"name": "pulley", "mass": 2, "inertia": 0.4, "position": [0.2, 0]}],
      "joints": [
        {"name": "pin", "type": "revolute", "bodies": ["pulley", "world"], "anchor": [0, 0.5]},
        {"name": "l", "type": "distance", "bodies": ["left", "pulley"],
         "anchors": [[-0.5, -1.1], [0, 0]], "limits": [0, null]},
        {"name": "r", "type": "distance", "bodies": ["pulley", "right"],
         "anchors": [[0.4, 0], [0.7, -0.9]], "limits": [0, null]},
        {"name": "rope", "type": "coupling", "joints": ["l", "r"], "ratio": 1}],
      "simulation": {"duration": 0.4, "dt": 0.002, "joint_correction": "projection",
        "stepping": ")") + stepping +
                                "\"}}");
    const std::vector<std::string> paths = {"bodies/left/mass", "joints/rope/ratio", "gravity/y",
                                            "joints/pin/anchor/x"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    testing::ExpectOthersAgree(scene, paths, result);
    const VectorX<double>& x = result.values;
    const auto point = [&](int body, double along, double up) {
      const double c = std::cos(x[6 * body + 2]), s = std::sin(x[6 * body + 2]);
      return Vector2<double>(x[6 * body] + c * along - s * up,
                             x[6 * body + 1] + s * along + c * up);
    };
    const double length = (point(0, 0.0, 0.1) - point(2, -0.2, 0.0)).norm() +
                          (point(1, 0.0, 0.1) - point(2, 0.2, 0.0)).norm();
    EXPECT_NEAR(length, std::hypot(0.5, 1.1) + std::hypot(0.3, 0.9), 1e-9) << stepping;
    if (stepping == std::string("fixed")) continue;
    double energy = 10.0 * (1.0 * 1.2 + 1.3 * 1.0);
    const double mass[] = {1.0, 1.3, 2.0}, inertia[] = {0.1, 0.1, 0.4};
    for (int k = 0; k < 3; ++k) {
      energy += 0.5 * mass[k] * (x[6 * k + 3] * x[6 * k + 3] + x[6 * k + 4] * x[6 * k + 4]) +
                0.5 * inertia[k] * x[6 * k + 5] * x[6 * k + 5] + 10.0 * mass[k] * x[6 * k + 1];
    }
    EXPECT_NEAR(energy, 0.0, 1e-7);
  }
}

// Play between two gears: the first turns freely by H, strikes, and the rate of the coupling is
// −e times what it was:  θ_1 = H + w (1 − (1 + e) k) (t − H / w),  k = 1 / (1 + r² I_1 / I_2).
TEST(CouplingsTest, PlayEndsInAnImpact) {
  const std::string gears = R"({"gravity": [0, 0], "bodies": [
      {"name": "first", "mass": 2, "inertia": 0.5, "position": [0, 0]},
      {"name": "second", "mass": 1, "inertia": 0.2, "position": [1, 0]}],
    "joints": [
      {"name": "a", "type": "revolute", "bodies": ["first", "world"], "anchor": [0, 0], "rate": 0.8},
      {"name": "b", "type": "revolute", "bodies": ["second", "world"], "anchor": [1, 0]},
      {"name": "gear", "type": "coupling", "joints": ["a", "b"], "ratio": 2, "limits": [null, 0.3],
       "limit_restitution": 0.5}])";
  const double w = 0.8, h = 0.3, e = 0.5, r = 2.0, i1 = 0.5, i2 = 0.2;
  const double k = 1.0 / (1.0 + r * r * i1 / i2);
  const double left = 1.0 - h / w;
  const double slope = -w * (1.0 + e) * left;  // by k
  const CoupledMotion exact = {h + w * (1.0 - (1.0 + e) * k) * left,
                               {"joints/gear/limits/1", "joints/gear/limit_restitution",
                                "joints/gear/ratio", "bodies/first/inertia"},
                               {(1.0 + e) * k, -w * k * left, slope * -k * k * 2.0 * r * i1 / i2,
                                slope * -k * k * r * r / i2}};
  ExpectMotion(gears, "event", 0.05, 2, exact);
}

}  // namespace
}  // namespace tangible
