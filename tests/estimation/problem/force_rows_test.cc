// SPDX-License-Identifier: Apache-2.0
//
// Observed forces of joints and contacts against closed forms, and their derivatives by every
// method.
#include "tangible/estimation/problem/force_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

constexpr GradientMethod kForceMethods[] = {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                            GradientMethod::kJetImplicit, GradientMethod::kJet,
                                            GradientMethod::kFiniteDifference};

std::string Settings(const char* stepping) {
  return std::string(R"(, "simulation": {"dt": 0.01, "duration": 1, "stepping": ")") + stepping +
         R"(", "joint_correction": "projection"}})";
}

Observation OfJoint(double time, Coordinate coordinate, int joint = 0) {
  Observation one;
  one.time = time;
  one.coordinate = coordinate;
  one.joint = joint;
  return one;
}

Observation OfContact(double time, Coordinate coordinate, int first = 0, int second = 1) {
  Observation one;
  one.time = time;
  one.coordinate = coordinate;
  one.pair[0] = first;
  one.pair[1] = second;
  return one;
}

struct Forces {
  Eigen::VectorXd values;
  RowMatrixXd by_parameters;
};

/// The forces and their derivatives; all methods agree.
Forces Evaluate(const Scene& scene, const std::vector<std::string>& paths,
                const std::vector<Observation>& observations, const Instruments& instruments = {}) {
  std::vector<FitParameter> parameters;
  for (const std::string& path : paths) {
    parameters.emplace_back();
    parameters.back().name = path;
    parameters.back().sets = {{path}};
  }
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(parameterized.Create(scene, {}, parameters, &error, instruments)) << error.what;
  Channel channel;
  channel.sensor = instruments.sensors.empty() ? -1 : 0;
  RolloutResiduals residuals(parameterized, observations, {channel});
  const Eigen::VectorXd p = residuals.scene().Initial();
  Forces forces;
  EXPECT_TRUE(
      residuals.Evaluate(p, GradientMethod::kAdjoint, &forces.values, &forces.by_parameters))
      << residuals.message();
  for (const GradientMethod method : kForceMethods) {
    if (!IsAvailable(method)) continue;
    Eigen::VectorXd values;
    RowMatrixXd jacobian;
    EXPECT_TRUE(residuals.Evaluate(p, method, &values, &jacobian)) << residuals.message();
    EXPECT_LT((values - forces.values).cwiseAbs().maxCoeff(), 1e-9) << NameOf(method);
    for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
      const double size = forces.by_parameters.col(k).cwiseAbs().maxCoeff();
      const double allowed = method == GradientMethod::kFiniteDifference ? 1e-5
                             : method == GradientMethod::kJet            ? 1e-6
                                                                         : 1e-8;
      EXPECT_LT((jacobian.col(k) - forces.by_parameters.col(k)).cwiseAbs().maxCoeff(),
                allowed * size + 1e-9)
          << NameOf(method) << ' ' << paths[static_cast<size_t>(k)];
    }
  }
  return forces;
}

// m a = F + m g, with the acceleration of the equation of motion at the pendulum's state.
TEST(ForceRowsTest, APinHoldsItsPendulum) {
  Scene scene = MakeScene(kPendulum);
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.integrator = Integrator::kRungeKutta4;
  for (const double time : {0.0, 0.1, 0.3217, 0.5}) {
    std::vector<Observation> observations = {OfJoint(time, Coordinate::kFx),
                                             OfJoint(time, Coordinate::kFy),
                                             OfJoint(time, Coordinate::kTorque)};
    for (const Coordinate one :
         {Coordinate::kX, Coordinate::kY, Coordinate::kVx, Coordinate::kVy, Coordinate::kOmega}) {
      Observation seen;
      seen.time = time;
      seen.body = 0;
      seen.coordinate = one;
      observations.push_back(seen);
    }
    const Forces forces =
        Evaluate(scene, {"bodies/bob/mass", "joints/pin/angle", "gravity/y", "joints/pin/damping"},
                 observations);
    const double x = forces.values[3], y = forces.values[4], omega = forces.values[7];
    const double alpha = (-0.5 * 9.81 * x - 0.05 * omega) / (0.02 + 0.5 * (x * x + y * y));
    EXPECT_NEAR(forces.values[0], 0.5 * (-alpha * y - omega * omega * x), 1e-9);
    EXPECT_NEAR(forces.values[1], 0.5 * (alpha * x - omega * omega * y + 9.81), 1e-9);
    EXPECT_NEAR(forces.values[2], 0.0, 1e-9);
    for (Eigen::Index k = 0; k < 4; ++k) EXPECT_GT(forces.by_parameters.col(k).norm(), 1e-3) << k;
  }
  // By fixed steps the impulses of the steps.
  scene = MakeScene(kPendulum);
  Evaluate(scene, {"bodies/bob/mass", "joints/pin/angle", "gravity/y", "joints/pin/damping"},
           {OfJoint(0.0, Coordinate::kFx), OfJoint(0.105, Coordinate::kFy),
            OfJoint(0.3, Coordinate::kFx), OfJoint(0.3, Coordinate::kFy)});
}

// The weight of a box on a floor, and its friction: it sticks under a push of 3 N and slides after
// a start at 2 m/s.
TEST(ForceRowsTest, AFloorHoldsABox) {
  const auto scene_of = [](const char* stepping, const char* speed, const char* push) {
    return MakeScene(std::string(R"({"gravity": [0, -10], "bodies": [
        {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
         "friction": 0.3, "velocity": [)") +
                     speed + R"(, 0]},
        {"name": "floor", "static": true, "friction": 0.3,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "forces": [{"name": "push", "body": "box", "force": [)" +
                     push + ", 0]}]" + Settings(stepping));
  };
  for (const char* stepping : {"event", "fixed"}) {
    for (const double time : {0.1, 0.125}) {
      const std::vector<Observation> observations = {
          OfContact(time, Coordinate::kNormal), OfContact(time, Coordinate::kTangent),
          OfContact(time, Coordinate::kNormal, 1, 0), OfContact(time, Coordinate::kTangent, 1, 0)};
      Forces forces =
          Evaluate(scene_of(stepping, "0", "3"),
                   {"bodies/box/mass", "forces/push/force/x", "bodies/box/friction"}, observations);
      for (const int i : {0, 2}) {
        EXPECT_NEAR(forces.values[i], 20.0, 1e-9) << stepping;
        EXPECT_NEAR(forces.values[i + 1], -3.0, 1e-9) << stepping;
        EXPECT_NEAR(forces.by_parameters(i, 0), 10.0, 1e-8) << stepping;
        EXPECT_NEAR(forces.by_parameters(i + 1, 0), 0.0, 1e-8) << stepping;
        EXPECT_NEAR(forces.by_parameters(i + 1, 1), -1.0, 1e-8) << stepping;
        EXPECT_NEAR(forces.by_parameters(i + 1, 2), 0.0, 1e-8) << stepping;
      }
      forces = Evaluate(scene_of(stepping, "2", "0"),
                        {"bodies/box/mass", "bodies/box/friction", "gravity/y"}, observations);
      for (const int i : {0, 2}) {
        EXPECT_NEAR(forces.values[i], 20.0, 1e-9) << stepping;
        EXPECT_NEAR(forces.values[i + 1], -6.0, 1e-9) << stepping;
        EXPECT_NEAR(forces.by_parameters(i + 1, 0), -3.0, 1e-8) << stepping;
        EXPECT_NEAR(forces.by_parameters(i + 1, 1), -10.0, 1e-8) << stepping;  // mean of two
        EXPECT_NEAR(forces.by_parameters(i + 1, 2), 0.6, 1e-8) << stepping;
      }
    }
  }
}

// The tension of Atwood's machine, 2 m_1 m_2 g / (m_1 + m_2), of a rope that is kept or a limit.
TEST(ForceRowsTest, ARopePullsBothWeights) {
  for (const char* stepping : {"event", "fixed"}) {
    for (const char* limits : {"", R"(, "limits": [null, 0])"}) {
      const Scene scene = MakeScene(std::string(R"({"gravity": [0, -10], "bodies": [
          {"name": "left", "mass": 3, "inertia": 0.1, "position": [0, 0]},
          {"name": "right", "mass": 1, "inertia": 0.1, "position": [1, 0.5]}],
        "joints": [
          {"name": "l", "type": "distance", "bodies": ["left", "world"],
           "anchors": [[0, 0], [0, 9]], "limits": [0, null]},
          {"name": "r", "type": "distance", "bodies": ["world", "right"],
           "anchors": [[1, 9], [1, 0.5]], "limits": [0, null]},
          {"name": "rope", "type": "coupling", "joints": ["l", "r"], "ratio": 1)") +
                                    limits + "}]" + Settings(stepping));
      const Forces forces =
          Evaluate(scene, {"bodies/left/mass", "bodies/right/mass", "gravity/y"},
                   {OfJoint(0.1, Coordinate::kFy, 0), OfJoint(0.1, Coordinate::kFx, 0),
                    OfJoint(0.1, Coordinate::kFy, 1)});
      EXPECT_NEAR(forces.values[0], 15.0, 1e-9) << stepping << limits;
      EXPECT_NEAR(forces.values[1], 0.0, 1e-9);
      EXPECT_NEAR(forces.values[2], -15.0, 1e-9);  // of the right weight on the pulley
      EXPECT_NEAR(forces.by_parameters(0, 0), 1.25, 1e-7);
      EXPECT_NEAR(forces.by_parameters(0, 1), 11.25, 1e-7);
      EXPECT_NEAR(forces.by_parameters(0, 2), -1.5, 1e-8);
    }
  }
}

// A beam that is held at its end: the torque about the anchor. A motor that spins a wheel up.
TEST(ForceRowsTest, TorquesOfAWeldAndOfAMotor) {
  for (const char* stepping : {"event", "fixed"}) {
    const Scene beam = MakeScene(std::string(R"({"gravity": [0, -10], "bodies": [
        {"name": "beam", "mass": 2, "inertia": 0.3, "position": [0.7, 0.2], "angle": 0.4}],
      "joints": [{"name": "wall", "type": "weld", "bodies": ["beam", "world"], "anchor": [0, 0]}])") +
                                 Settings(stepping));
    Forces forces = Evaluate(beam, {"bodies/beam/mass", "bodies/beam/position/x"},
                             {OfJoint(0.2, Coordinate::kTorque), OfJoint(0.2, Coordinate::kFy)});
    EXPECT_NEAR(forces.values[0], 14.0, 1e-8) << stepping;
    EXPECT_NEAR(forces.values[1], 20.0, 1e-8) << stepping;
    EXPECT_NEAR(forces.by_parameters(0, 0), 7.0, 1e-7) << stepping;
    EXPECT_NEAR(forces.by_parameters(0, 1), 20.0, 1e-7) << stepping;
    const Scene wheel = MakeScene(std::string(R"({"gravity": [0, 0], "bodies": [
        {"name": "wheel", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
      "joints": [{"name": "hub", "type": "revolute", "bodies": ["wheel", "world"],
        "anchor": [0, 0], "motor": {"speed": 100, "limit": 0.7}}])") +
                                  Settings(stepping));
    Instruments instruments;
    instruments.sensors.push_back({"cell", 0.0, 2.0, 0.1});
    forces = Evaluate(wheel, {"joints/hub/motor/limit", "sensors/cell/gain", "sensors/cell/bias"},
                      {OfJoint(0.2, Coordinate::kTorque)}, instruments);
    EXPECT_NEAR(forces.values[0], 1.5, 1e-9) << stepping;
    EXPECT_NEAR(forces.by_parameters(0, 0), 2.0, 1e-8) << stepping;
    EXPECT_NEAR(forces.by_parameters(0, 1), 0.7, 1e-8) << stepping;
    EXPECT_NEAR(forces.by_parameters(0, 2), 1.0, 1e-8) << stepping;
  }
}

}  // namespace
}  // namespace tangible
