// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/residual.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// Largest error of a Jacobian, each column against its largest entry.
double ColumnError(const RowMatrixXd& a, const RowMatrixXd& b) {
  double worst = 0.0;
  for (Eigen::Index k = 0; k < b.cols(); ++k) {
    worst = std::max(worst,
                     (a.col(k) - b.col(k)).cwiseAbs().maxCoeff() / b.col(k).cwiseAbs().maxCoeff());
  }
  return worst;
}

/// All methods at the parameters' initial values against the tangent.
void ExpectMethodsAgree(RolloutResiduals residuals) {
  const Eigen::VectorXd p = residuals.scene().Initial();
  Eigen::VectorXd r;
  RowMatrixXd tangent;
  ASSERT_TRUE(residuals.Evaluate(p, GradientMethod::kTangent, &r, &tangent)) << residuals.message();
  for (Eigen::Index k = 0; k < tangent.cols(); ++k) {
    EXPECT_GT(tangent.col(k).norm(), 1e-3) << residuals.scene().entries()[k].name;
  }
  // Tolerances of the methods as README states them.
  const std::pair<GradientMethod, double> methods[] = {{GradientMethod::kAdjoint, 1e-9},
                                                       {GradientMethod::kJetImplicit, 1e-9},
                                                       {GradientMethod::kJet, 1e-6},
                                                       {GradientMethod::kFiniteDifference, 1e-5}};
  for (const auto& [method, tolerance] : methods) {
    if (!IsAvailable(method)) {
      continue;
    }
    Eigen::VectorXd other;
    RowMatrixXd jacobian;
    ASSERT_TRUE(residuals.Evaluate(p, method, &other, &jacobian))
        << NameOf(method) << ": " << residuals.message();
    EXPECT_EQ(r, other) << NameOf(method);
    EXPECT_LT(ColumnError(jacobian, tangent), tolerance) << NameOf(method);
    if (method == GradientMethod::kFiniteDifference) {
      EXPECT_GT(ColumnError(jacobian, tangent), 0.0);
    }
  }
}

/// Adds points and times between steps to the observations.
std::vector<Observation> WithPoints(std::vector<Observation> observations, double dt) {
  const size_t count = observations.size();
  for (size_t i = 0; i < count; ++i) {
    if (observations[i].time < 0.3) {
      Observation moved = observations[i];
      moved.time += 0.37 * dt;
      moved.point = moved.body == 0 ? 0 : -1;
      moved.sigma *= 1.0 + 0.5 * static_cast<double>(i % 3);
      observations.push_back(moved);
    }
  }
  return observations;
}

TEST(ResidualTest, IsTheDifferenceInSigmas) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations = Observe(scene, 10, 0.0, 1);
  for (Observation& observation : observations) {
    observation.value -= 3.0;
    observation.sigma = 0.5;
  }
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("gravity/y", -9.81)}, observations);
  Eigen::VectorXd r;
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, nullptr));
  ASSERT_EQ(r.size(), static_cast<Eigen::Index>(observations.size()));
  for (const double x : r) {
    EXPECT_NEAR(x, 6.0, 1e-12);
  }
  EXPECT_EQ(residuals.rollouts(), 1);
}

TEST(ResidualTest, BetweenStepsPositionsAreLinear) {
  const Scene scene = MakeScene(kPendulum);
  const std::vector<Observation> on_steps = Observe(scene, 1, 0.0, 1);
  std::vector<Observation> between;
  for (size_t i = 0; i + 3 < on_steps.size(); ++i) {
    Observation observation = on_steps[i];
    observation.time = 0.75 * on_steps[i].time + 0.25 * on_steps[i + 3].time;
    observation.value = 0.75 * on_steps[i].value + 0.25 * on_steps[i + 3].value;
    between.push_back(observation);
  }
  RolloutResiduals residuals = MakeResiduals(scene, {}, {Parameter("gravity/y", -9.81)}, between);
  Eigen::VectorXd r;
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, nullptr));
  // Rounding of positions of order 1 in sigmas of 1e-3.
  EXPECT_LT(r.cwiseAbs().maxCoeff(), 1e-11);
}

TEST(ResidualTest, MethodsAgreeOnABallInAir) {
  const Scene scene = MakeScene(kFallingBall);
  ExpectMethodsAgree(
      MakeResiduals(scene, {},
                    {Parameter("gravity/y", -9.0), Parameter("bodies/ball/linear_damping", 0.4),
                     Parameter("bodies/ball/velocity/x", 1.5)},
                    Observe(scene, 3, 0.01, 2)));
}

TEST(ResidualTest, MethodsAgreeOnASlidingBox) {
  const Scene scene = MakeScene(kSlidingBox);
  ExpectMethodsAgree(
      MakeResiduals(scene, {{"corner", 0, {0.2, 0.1}}},
                    {Parameter("bodies/box/friction", 0.35), Parameter("bodies/box/mass", 2.2),
                     Parameter("forces/push/force/x", 1.2), Parameter("points/corner/at/x", 0.21)},
                    WithPoints(Observe(scene, 4, 0.01, 3), scene.simulation.dt)));
}

TEST(ResidualTest, MethodsAgreeOnAChainThatIsHit) {
  const Scene scene = MakeScene(kSmallChain);
  FitParameter mass = Parameter("bodies/link*/mass", 2.0);
  mass.sets[0].scale = 0.3;
  ExpectMethodsAgree(MakeResiduals(
      scene, {{"tip", 0, {0.1, -0.02}}},
      {mass, Parameter("bodies/ball/velocity/y", 1.9), Parameter("joints/j1/angle", 0.12),
       Parameter("joints/j*/damping", 0.02), Parameter("bodies/ball/friction", 0.04),
       Parameter("points/tip/at/y", 0.0), Parameter("bodies/ball/shape/radius", 0.1)},
      WithPoints(Observe(scene, 5, 0.001, 4), scene.simulation.dt)));
}

TEST(ResidualTest, DifferencesStayWithinTheBounds) {
  // A friction of 0 has no central difference; the one-sided one is of second order.
  const Scene scene = MakeScene(kSlidingBox);
  FitParameter friction = Parameter("bodies/box/friction", 0.0);
  friction.lower = 0.0;
  ExpectMethodsAgree(MakeResiduals(scene, {}, {friction}, Observe(scene, 4, 0.01, 3)));
}

TEST(ResidualTest, TheRunEndsWithTheLastObservation) {
  Scene scene = MakeScene(kFallingBall);
  scene.simulation.duration = 1e6;
  Observation observation;
  observation.time = 0.02;
  observation.body = 0;
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("gravity/y", -9.81)}, {observation});
  Eigen::VectorXd r;
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &r, nullptr));
  EXPECT_EQ(residuals.scene().scene().simulation.duration, 0.02);
}

TEST(ResidualTest, AValueThatANumberMayNotTakeIsAFailure) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("bodies/ball/mass", 1.0)}, Observe(scene, 10, 0.0, 1));
  Eigen::VectorXd r;
  EXPECT_FALSE(residuals.Evaluate(Eigen::VectorXd::Constant(1, -1.0), GradientMethod::kTangent, &r,
                                  nullptr));
  EXPECT_FALSE(residuals.message().empty());
}

/// The small chain's links and ball by every kind of instrument, all numbers of which are
/// parameters.
RolloutResiduals RecordedChain(Stepping stepping) {
  Scene scene = MakeScene(kSmallChain);
  scene.simulation.stepping = stepping;
  if (stepping == Stepping::kEvent) {
    // How a sample moves with its time is exact to the order of the step: to 7e-5 at 5 ms.
    scene.simulation.dt = 0.001;
  }
  const std::vector<BodyPoint> points = {{"tip", 2, {0.15, -0.02}}, {"eye", 0, {0.02, 0.03}}};
  Instruments instruments;
  instruments.sensors = {{"late", 0.0033, 1.1, -0.2}};
  instruments.cameras = {{"camera", 300.0, 0.2, {0.1, 1.0}, 0, 1, 1.02, 0.03, 0.5}};
  instruments.clocks = {{"clock", 0.95, 0.02}};
  std::vector<Channel> channels(6);
  channels[1].sensor = 0;
  channels[2].camera = 0;
  channels[3].clock = 0;
  channels[3].to_body = 0;
  channels[3].to_point = 1;
  channels[4] = {.sensor = 0, .camera = 0, .clock = 0};
  channels[5].to_body = 3;
  std::vector<Observation> observations;
  for (int i = 0; i < 84; ++i) {
    Observation observation;
    observation.time = 0.0137 + 0.0052 * i;
    observation.body = i % 4;
    observation.point = observation.body == 2 ? 0 : -1;
    observation.channel = (i / 4) % 6;
    observation.coordinate = static_cast<Coordinate>((i / 3) % kBodyCoordinates);
    // The distance of the ball to itself, and from nothing, is no observation.
    if (observation.coordinate == Coordinate::kDistance &&
        (channels[observation.channel].to_body < 0 || observation.body == 3)) {
      observation.coordinate = Coordinate::kVy;
    }
    observation.sigma = 0.5;
    observations.push_back(observation);
  }
  std::vector<FitParameter> parameters = {
      Parameter("bodies/ball/velocity/x", 3.1), Parameter("joints/j1/angle", 0.12),
      Parameter("points/tip/at/x", 0.16), Parameter("points/eye/at/y", 0.02)};
  for (const InstrumentNumber& number : EnumerateNumbers(&instruments)) {
    parameters.push_back(Parameter(number.path, *number.value));
  }
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(parameterized.Create(scene, points, parameters, &error, instruments)) << error.what;
  return RolloutResiduals(parameterized, observations, channels);
}

TEST(ResidualTest, MethodsAgreeOnAllInstruments) {
  ExpectMethodsAgree(RecordedChain(Stepping::kFixed));
}

// The unrolled Jets have no event stepping; the others see every time move with its delay.
TEST(ResidualTest, MethodsAgreeOnAllInstrumentsByEvents) {
  RolloutResiduals residuals = RecordedChain(Stepping::kEvent);
  const Eigen::VectorXd p = residuals.scene().Initial();
  Eigen::VectorXd r;
  RowMatrixXd tangent;
  ASSERT_TRUE(residuals.Evaluate(p, GradientMethod::kTangent, &r, &tangent)) << residuals.message();
  for (Eigen::Index k = 0; k < tangent.cols(); ++k) {
    EXPECT_GT(tangent.col(k).norm(), 1e-3) << residuals.scene().entries()[k].name;
  }
  for (const auto& [method, tolerance] : {std::pair(GradientMethod::kAdjoint, 1e-9),
                                          std::pair(GradientMethod::kFiniteDifference, 1e-5)}) {
    Eigen::VectorXd other;
    RowMatrixXd jacobian;
    ASSERT_TRUE(residuals.Evaluate(p, method, &other, &jacobian)) << residuals.message();
    EXPECT_EQ(r, other) << NameOf(method);
    EXPECT_LT(ColumnError(jacobian, tangent), tolerance) << NameOf(method);
  }
}

/// One sample at 0.5 s of the run, of a body's x or y, by a sensor that may be late and a clock
/// that may be wrong; all three numbers of them are parameters, and `path`.
RolloutResiduals OneSample(const Scene& scene, Coordinate coordinate, const std::string& path,
                           double value) {
  Instruments instruments;
  instruments.sensors = {{"late", 0.25}};
  instruments.clocks = {{"clock", 2.0, 0.25}};
  std::vector<Channel> channels(1);
  channels[0].sensor = 0;
  channels[0].clock = 0;
  Observation observation;
  observation.time = 0.25;
  observation.body = 0;
  observation.coordinate = coordinate;
  observation.sigma = 1.0;
  const std::vector<FitParameter> parameters = {
      Parameter("sensors/late/delay", 0.25), Parameter("clocks/clock/rate", 2.0),
      Parameter("clocks/clock/offset", 0.25), Parameter(path, value)};
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(parameterized.Create(scene, {}, parameters, &error, instruments)) << error.what;
  return RolloutResiduals(parameterized, {observation}, channels);
}

/// The residual moves with the sample's time by `speed`, and with the parameter by `by_path`.
void ExpectMovesWithItsTime(RolloutResiduals residuals, double speed, double by_path,
                            const std::vector<GradientMethod>& methods) {
  const Eigen::VectorXd p = residuals.scene().Initial();
  const double expected[] = {-speed, 0.25 * speed, speed, by_path};
  for (const GradientMethod method : methods) {
    if (!IsAvailable(method)) continue;
    Eigen::VectorXd r;
    RowMatrixXd jacobian;
    ASSERT_TRUE(residuals.Evaluate(p, method, &r, &jacobian)) << residuals.message();
    const double tolerance = method == GradientMethod::kFiniteDifference ? 3e-5 : 1e-9;
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(jacobian(0, k), expected[k], tolerance) << NameOf(method) << ", parameter " << k;
    }
  }
}

// Sampled on the end of a step: v_k = v − g t_k, positions with the new speeds, so that the slopes
// before and after it are v_k and v_{k+1}.
TEST(ResidualTest, ASampleOnAStepsEndMovesWithTheMeanOfBothSlopes) {
  Scene scene = MakeScene(kFallingBall);
  scene.bodies[0].linear_damping = 0.0;
  scene.gravity.y() = -10.0;
  for (const double dt : {0.25, 0.1, 0.05}) {
    scene.simulation.dt = dt;
    const double before = 3.0 - 10.0 * 0.5;
    ExpectMovesWithItsTime(
        OneSample(scene, Coordinate::kY, "bodies/ball/velocity/y", 3.0), before - 0.5 * 10.0 * dt,
        0.5,
        {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJetImplicit,
         GradientMethod::kJet, GradientMethod::kFiniteDifference});
  }
}

// By events, sampled as a box comes to rest, which is not a kink of its position: x = v² / (2 μ g);
// and as a force begins to push it.
TEST(ResidualTest, ASampleOnAnEventMovesWithTheSpeedThere) {
  Scene scene = MakeScene(kSlidingBox);
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.duration = 1.0;
  scene.gravity.y() = -10.0;
  scene.bodies[0].friction = scene.bodies[1].friction = 0.25;
  const std::vector<GradientMethod> methods = {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                               GradientMethod::kFiniteDifference};
  for (const double dt : {0.5, 0.25, 0.1, 0.07}) {
    scene.simulation.dt = dt;
    scene.forces[0].force = Vector2<double>(0.0, 0.0);
    scene.bodies[0].velocity.x() = 0.25 * 10.0 * 0.5;
    ExpectMovesWithItsTime(OneSample(scene, Coordinate::kX, "bodies/box/velocity/x", 1.25), 0.0,
                           0.5, methods);
    scene.forces[0].force = Vector2<double>(20.0, 0.0);
    scene.forces[0].start = 0.5;
    scene.forces[0].end = 2.0;
    scene.bodies[0].velocity.x() = 2.5;
    ExpectMovesWithItsTime(OneSample(scene, Coordinate::kX, "bodies/box/velocity/x", 2.5), 1.25,
                           0.5, methods);
  }
}

TEST(ResidualTest, ATimeThatLeavesTheRunIsAFailure) {
  Scene scene = MakeScene(kFallingBall);
  Instruments instruments;
  instruments.sensors = {{"late", 0.01}};
  Channel channel;
  channel.sensor = 0;
  ParameterizedScene parameterized;
  ParameterError error;
  ASSERT_TRUE(
      parameterized.Create(scene, {}, {Parameter("sensors/late/delay", 0.01)}, &error, instruments))
      << error.what;
  RolloutResiduals residuals(parameterized, {{0.05, 0, -1, Coordinate::kX, 0.0, 1.0}}, {channel});
  Eigen::VectorXd r;
  ASSERT_TRUE(
      residuals.Evaluate(Eigen::VectorXd::Constant(1, 0.05), GradientMethod::kTangent, &r, nullptr))
      << residuals.message();
  EXPECT_NEAR(r[0], 0.0, 1e-15);
  EXPECT_FALSE(residuals.Evaluate(Eigen::VectorXd::Constant(1, 0.06), GradientMethod::kTangent, &r,
                                  nullptr));
  EXPECT_NE(residuals.message().find("recorded at 0.05 s is of the time -0.01 s"),
            std::string::npos)
      << residuals.message();
}

// A ball lands after 0.2 s, the end of a step.
TEST(ResidualTest, AnObservationOnAnImpactIsNamed) {
  const Scene scene = MakeScene(R"({"gravity": [0, -10], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.25}}, "mass": 1, "position": [0, 0.45],
       "restitution": 0.5},
      {"name": "floor", "static": true, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"stepping": "event", "dt": 0.05, "duration": 0.4}})");
  const auto verdict = [&](double time, Coordinate coordinate) {
    Observation observation;
    observation.time = time;
    observation.body = 0;
    observation.coordinate = coordinate;
    observation.value = 0.3;
    observation.sigma = 0.01;
    Observation last = observation;  // without it the run would end at the impact
    last.time = 0.35;
    RolloutResiduals residuals =
        MakeResiduals(scene, {}, {Parameter("bodies/ball/position/y", 0.45)}, {observation, last});
    return residuals.Certify(residuals.scene().Initial())->verdict;
  };
  EXPECT_EQ(verdict(0.2, Coordinate::kY),
            "one-sided: an observation of ball at 0.2 s falls on an impact");
  EXPECT_EQ(verdict(0.2, Coordinate::kVy),
            "discontinuous: an observation of ball at 0.2 s falls on an impact");
  for (const double time : {0.15, 0.25, 0.3}) {
    EXPECT_EQ(verdict(time, Coordinate::kY), "trustworthy") << time;
    EXPECT_EQ(verdict(time, Coordinate::kVy), "trustworthy") << time;
  }
}

}  // namespace
}  // namespace tangible
