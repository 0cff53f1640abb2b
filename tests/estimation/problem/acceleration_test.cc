// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/acceleration.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

constexpr GradientMethod kEveryMethod[] = {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                           GradientMethod::kJetImplicit, GradientMethod::kJet,
                                           GradientMethod::kFiniteDifference};
constexpr Coordinate kAccelerations[] = {Coordinate::kAx, Coordinate::kAy, Coordinate::kAlpha};

Scene Pendulum(Stepping stepping) {
  Scene scene = MakeScene(kPendulum);
  if (stepping == Stepping::kEvent) {
    scene.simulation.stepping = Stepping::kEvent;
    scene.simulation.integrator = Integrator::kRungeKutta4;
    scene.simulation.joint_correction = JointCorrection::kProjection;
  }
  return scene;
}

Observation At(double time, Coordinate coordinate, int point = -1) {
  Observation one;
  one.time = time;
  one.body = 0;
  one.point = point;
  one.coordinate = coordinate;
  return one;
}

RolloutResiduals AccelerationResiduals(const Scene& scene,
                                       const std::vector<FitParameter>& parameters,
                                       const std::vector<Observation>& observations,
                                       const Channel& channel,
                                       const Instruments& instruments = {}) {
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(
      parameterized.Create(scene, {{"phone", 0, {0.1, -0.2}}}, parameters, &error, instruments))
      << error.what;
  return {parameterized, observations, {channel}};
}

/// ax, ay, alpha of the point from the equation of motion of the pendulum of fit_scenes.h at a
/// state of its bob.
Eigen::Vector3d Expected(const double* state, const Channel& channel) {
  const double x = state[0];  // from the pin
  const double y = state[1];
  const double omega = state[5];
  // (I + m l²) α = −m g x − c ω,   a = α (−y, x) − ω² (x, y)
  const double alpha = (-0.5 * 9.81 * x - 0.05 * omega) / (0.02 + 0.5 * (x * x + y * y));
  const double c = std::cos(state[2]);
  const double s = std::sin(state[2]);
  const double px = x + c * 0.1 + s * 0.2;
  const double py = y + s * 0.1 - c * 0.2;
  const double ax = -alpha * py - omega * omega * px;
  const double ay = alpha * px - omega * omega * py + (channel.gravity ? 9.81 : 0.0);
  if (!channel.body_frame) return {ax, ay, alpha};
  return {c * ax + s * ay, c * ay - s * ax, alpha};
}

Channel Of(bool body_frame, bool gravity) {
  Channel channel;
  channel.body_frame = body_frame;
  channel.gravity = gravity;
  return channel;
}

TEST(AccelerationTest, FollowsFromTheEquationOfMotion) {
  const Scene scene = Pendulum(Stepping::kEvent);
  for (const Channel& channel :
       {Of(false, false), Of(true, false), Of(false, true), Of(true, true)}) {
    for (const double time : {0.1, 0.3217}) {
      std::vector<Observation> observations;
      for (const Coordinate one : kAccelerations) observations.push_back(At(time, one, 0));
      for (const Coordinate one : {Coordinate::kX, Coordinate::kY, Coordinate::kAngle,
                                   Coordinate::kVx, Coordinate::kVy, Coordinate::kOmega}) {
        observations.push_back(At(time, one));
      }
      RolloutResiduals residuals =
          AccelerationResiduals(scene, {Parameter("bodies/bob/mass", 0.5)}, observations, channel);
      Eigen::VectorXd r;
      ASSERT_TRUE(
          residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, nullptr));
      const Eigen::VectorXd state = r.tail(6);
      const Eigen::Vector3d expected = Expected(state.data(), channel);
      // The mean over 2e-5 s, rounding of speeds of 1 m/s over that, and the integrator's error.
      EXPECT_LT((r.head(3) - expected).cwiseAbs().maxCoeff(), 1e-7)
          << r.head(3).transpose() << " " << expected.transpose();
    }
  }
}

TEST(AccelerationTest, AtRestGravityIsShownUpwards) {
  Scene scene = MakeScene(R"({"name": "rest", "bodies": [
    {"name": "bob", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
     "friction": 0.5},
    {"name": "floor", "static": true, "friction": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.2, "stepping": "event"}})");
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    scene.simulation.stepping = stepping;
    if (stepping == Stepping::kFixed) {
      scene.simulation.integrator = Integrator::kSemiImplicitEuler;
      scene.simulation.joint_correction = JointCorrection::kNone;
    }
    for (const double time : {0.0, 0.053, 0.2}) {
      RolloutResiduals residuals = AccelerationResiduals(
          scene, {Parameter("gravity/y", -9.81)},
          {At(time, Coordinate::kAx, 0), At(time, Coordinate::kAy, 0)}, Of(true, true));
      Eigen::VectorXd r;
      RowMatrixXd jacobian;
      ASSERT_TRUE(
          residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, &jacobian));
      EXPECT_NEAR(r[0], 0.0, 1e-9);
      EXPECT_NEAR(r[1], 9.81, 1e-9);
      EXPECT_NEAR(jacobian(1, 0), -1.0, 1e-7);
    }
  }
}

TEST(AccelerationTest, WithFixedStepsItIsThatOfTheStep) {
  Scene scene = MakeScene(kFallingBall);  // 2 kg, damping 0.3, velocity (1, 3)
  RolloutResiduals residuals =
      AccelerationResiduals(scene, {Parameter("bodies/ball/linear_damping", 0.3)},
                            {At(0.0, Coordinate::kAx), At(0.0, Coordinate::kAy)}, Of(false, false));
  Eigen::VectorXd r;
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, nullptr));
  // Damping is implicit: (M + h C) v⁺ = M v + h f.
  EXPECT_NEAR(r[0], (1.0 / (1.0 + 0.01 * 0.15) - 1.0) / 0.01, 1e-12);
  EXPECT_NEAR(r[1], ((3.0 - 0.0981) / (1.0 + 0.01 * 0.15) - 3.0) / 0.01, 1e-12);
}

TEST(AccelerationTest, MethodsAgree) {
  Instruments instruments;
  instruments.sensors.push_back({"phone", 0.01, 1.1, 0.2});
  Channel channel = Of(true, true);
  channel.sensor = 0;
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    const Scene scene = Pendulum(stepping);
    std::vector<Observation> observations;
    for (const double time : {0.05, 0.1234, 0.3, 0.41}) {
      for (const Coordinate one : kAccelerations) observations.push_back(At(time, one, 0));
    }
    RolloutResiduals residuals = AccelerationResiduals(
        scene,
        {Parameter("bodies/bob/mass", 0.5), Parameter("joints/pin/damping", 0.05),
         Parameter("joints/pin/angle", 1.0), Parameter("gravity/y", -9.81),
         Parameter("points/phone/at/x", 0.1), Parameter("sensors/phone/gain", 1.1),
         Parameter("sensors/phone/bias", 0.2), Parameter("sensors/phone/delay", 0.01)},
        observations, channel, instruments);
    const Eigen::VectorXd p = residuals.scene().Initial();
    Eigen::VectorXd r;
    RowMatrixXd tangent;
    ASSERT_TRUE(residuals.Evaluate(p, GradientMethod::kTangent, &r, &tangent))
        << residuals.message();
    for (Eigen::Index k = 0; k < tangent.cols(); ++k) EXPECT_GT(tangent.col(k).norm(), 1e-3) << k;
    for (const GradientMethod method : kEveryMethod) {
      if (!IsAvailable(method)) continue;
      Eigen::VectorXd other;
      RowMatrixXd jacobian;
      ASSERT_TRUE(residuals.Evaluate(p, method, &other, &jacobian)) << NameOf(method);
      EXPECT_LT((r - other).cwiseAbs().maxCoeff(), 1e-9) << NameOf(method);
      for (Eigen::Index k = 0; k < tangent.cols(); ++k) {
        // Derivatives with respect to a delay are second differences of twists over (1e-3 dt)².
        const double allowed = method == GradientMethod::kFiniteDifference ? 1e-4
                               : method == GradientMethod::kJet            ? 1e-6
                                                                           : 1e-8;
        EXPECT_LT((jacobian.col(k) - tangent.col(k)).cwiseAbs().maxCoeff(),
                  allowed * tangent.col(k).cwiseAbs().maxCoeff())
            << NameOf(method) << " " << residuals.scene().entries()[k].name;
      }
    }
  }
}

}  // namespace
}  // namespace tangible
