// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/event_times.h"

#include <gtest/gtest.h>

#include "../../support/bouncing_ball.h"
#include "../../support/fit_scenes.h"
#include "tangible/estimation/problem/event_file.h"

namespace tangible {
namespace {

constexpr GradientMethod kAll[] = {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                   GradientMethod::kJetImplicit, GradientMethod::kJet,
                                   GradientMethod::kFiniteDifference};

Observation EventOf(int event, int number, double time, double sigma = 1.0) {
  Observation observation;
  observation.coordinate = Coordinate::kTime;
  observation.body = 0;
  observation.event = event;
  observation.number = number;
  observation.time = time;
  observation.value = time;
  observation.sigma = sigma;
  return observation;
}

RolloutResiduals Residuals(const Scene& scene, const Instruments& instruments,
                           const std::vector<FitParameter>& parameters,
                           const std::vector<Observation>& observations,
                           const std::vector<Channel>& channels = {}) {
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(parameterized.Create(scene, {}, parameters, &error, instruments)) << error.what;
  return {parameterized, observations, channels};
}

Instruments BounceOf(ObservedEventKind kind = ObservedEventKind::kTouch, int a = 0, int b = 1) {
  Instruments instruments;
  instruments.events.push_back({"bounce", {a, b}, kind});
  return instruments;
}

/// All methods at the initial values; the values and the largest error of each column against
/// `expected`.
void ExpectDerivatives(RolloutResiduals* of, const Eigen::VectorXd& values,
                       const RowMatrixXd& expected, double tolerance) {
  RolloutResiduals& residuals = *of;
  for (const GradientMethod method : kAll) {
    if (!IsAvailable(method)) continue;
    Eigen::VectorXd r;
    RowMatrixXd jacobian;
    ASSERT_TRUE(residuals.Evaluate(residuals.scene().Initial(), method, &r, &jacobian))
        << NameOf(method) << ": " << residuals.message();
    EXPECT_LT((r - values).cwiseAbs().maxCoeff(), 1e-9) << NameOf(method);
    for (Eigen::Index k = 0; k < expected.cols(); ++k) {
      const double size = expected.col(k).cwiseAbs().maxCoeff();
      // Central differences of times that are located to rounding.
      const double allowed = method == GradientMethod::kFiniteDifference ? 1e-6 : tolerance;
      EXPECT_LT((jacobian.col(k) - expected.col(k)).cwiseAbs().maxCoeff(), allowed * size)
          << NameOf(method) << " " << residuals.scene().entries()[k].name;
    }
  }
}

void ExpectDerivatives(RolloutResiduals&& residuals, const Eigen::VectorXd& values,
                       const RowMatrixXd& expected, double tolerance) {
  ExpectDerivatives(&residuals, values, expected, tolerance);
}

TEST(EventTimesTest, BouncesHaveTheDerivativesOfTheirClosedForms) {
  const Scene scene = MakeScene(kBouncingBall);
  const Bounces bounces;
  std::vector<Observation> observations;
  Eigen::VectorXd values(7);
  RowMatrixXd expected(7, 3);
  for (int i = 0; i < 7; ++i) {
    const int n = i + 1;
    observations.push_back(EventOf(0, n, 0.1 * n));
    values[i] = bounces.Time(n) - 0.1 * n;
    // gravity/y is −g.
    expected.row(i) << bounces.ByHeight(n), bounces.ByRestitution(n), -bounces.ByGravity(n);
  }
  ExpectDerivatives(
      Residuals(scene, BounceOf(),
                {Parameter("bodies/ball/position/y", 1.1),
                 Parameter("pairs/ball:floor/restitution", 0.8), Parameter("gravity/y", -9.81)},
                observations),
      values, expected, 1e-7);
}

TEST(EventTimesTest, DerivativesDoNotDependOnTheStep) {
  // A bounce at the end of a step, at its start and inside have one derivative.
  const Bounces bounces;
  for (const double dt : {0.01, 0.0371, bounces.Time(2), 0.5 * bounces.Time(1)}) {
    Scene scene = MakeScene(kBouncingBall);
    scene.simulation.dt = dt;
    RowMatrixXd expected(2, 1);
    expected << bounces.ByHeight(2), bounces.ByHeight(3);
    ExpectDerivatives(Residuals(scene, BounceOf(), {Parameter("bodies/ball/position/y", 1.1)},
                                {EventOf(0, 2, 0.0), EventOf(0, 3, 0.0)}),
                      Eigen::Vector2d(bounces.Time(2), bounces.Time(3)), expected, 1e-7);
  }
}

TEST(EventTimesTest, ClockAndSensorActOnTimes) {
  const Scene scene = MakeScene(kBouncingBall);
  Instruments instruments = BounceOf();
  instruments.sensors.push_back({"microphone", 0.02, 1.1, 0.3});
  instruments.clocks.push_back({"watch", 1.25, -0.5});
  Channel channel;
  channel.sensor = 0;
  channel.clock = 0;
  const double t = Bounces().Time(2);
  const double u = (t + 0.02 + 0.5) / 1.25;
  RowMatrixXd expected(1, 6);
  expected << 1.1 / 1.25, u, 1.0, -1.1 / 1.25 * u, -1.1 / 1.25, 1.1 / 1.25 * Bounces().ByHeight(2);
  expected /= 0.5;
  ExpectDerivatives(
      Residuals(
          scene, instruments,
          {Parameter("sensors/microphone/delay", 0.02), Parameter("sensors/microphone/gain", 1.1),
           Parameter("sensors/microphone/bias", 0.3), Parameter("clocks/watch/rate", 1.25),
           Parameter("clocks/watch/offset", -0.5), Parameter("bodies/ball/position/y", 1.1)},
          {EventOf(0, 2, 0.7, 0.5)}, {channel}),
      Eigen::VectorXd::Constant(1, (1.1 * u + 0.3 - 0.7) / 0.5), expected, 1e-7);
}

TEST(EventTimesTest, AnEventBeyondTheEndIsPulledBack) {
  // It falls from too high: the first touch is not in the run.
  Scene scene = MakeScene(kBouncingBall);
  scene.simulation.duration = 0.4;
  RolloutResiduals residuals = Residuals(
      scene, BounceOf(), {Parameter("bodies/ball/position/y", 1.1)}, {EventOf(0, 1, 0.3)});
  const double gap = 1.0 - 0.5 * 9.81 * 0.16;
  const double sum = gap + 0.1;
  RowMatrixXd expected(1, 1);
  expected << 0.4 * 0.1 / (sum * sum);
  ExpectDerivatives(&residuals, Eigen::VectorXd::Constant(1, 0.4 + 0.4 * gap / sum - 0.3), expected,
                    1e-7);
  const std::vector<std::string> lines = residuals.FindInconsistencies(residuals.scene().Initial());
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("event bounce 1, recorded at 0.3 s, does not happen"), std::string::npos)
      << lines[0];
  // It continues the time of the event as that passes the end of the run.
  const double last = 0.1 + 0.5 * 9.81 * 0.16;
  Eigen::VectorXd before, after;
  ASSERT_TRUE(residuals.Evaluate(Eigen::VectorXd::Constant(1, last - 1e-7),
                                 GradientMethod::kTangent, &before, nullptr));
  ASSERT_TRUE(residuals.Evaluate(Eigen::VectorXd::Constant(1, last + 1e-7),
                                 GradientMethod::kTangent, &after, nullptr));
  EXPECT_NEAR(before[0], 0.1, 1e-6);
  EXPECT_NEAR(after[0], 0.1, 1e-6);
  EXPECT_GT(after[0], before[0]);
}

TEST(EventTimesTest, BouncesThatEndTooEarlyArePulledLater) {
  // With this restitution the ball rests after few bounces; the 40th has the time of the last one.
  Scene scene = MakeScene(kBouncingBall);
  RolloutResiduals residuals = Residuals(
      scene, BounceOf(), {Parameter("pairs/ball:floor/restitution", 0.3)}, {EventOf(0, 40, 3.9)});
  Eigen::VectorXd r;
  RowMatrixXd jacobian;
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kAdjoint, &r, &jacobian));
  Bounces bounces;
  bounces.restitution = 0.3;
  // The limit of the series is reached to the speed below which it does not rebound, 1e-3 m/s.
  EXPECT_NEAR(r[0] + 3.9, bounces.Time(60), 1e-3);
  EXPECT_NEAR(jacobian(0, 0), bounces.ByRestitution(60), 1e-2);
}

TEST(EventTimesTest, ABoxStopsAndStartsToSlide) {
  // It slides and sticks; a push moves it again.
  const Scene scene = MakeScene(R"({"name": "box", "bodies": [
    {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
     "velocity": [1, 0], "friction": 0.3},
    {"name": "floor", "static": true, "friction": 0.3,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "forces": [{"name": "push", "body": "box", "force": [10, 0], "start": 0.6, "end": 0.7}],
    "simulation": {"dt": 0.01, "duration": 1.5, "stepping": "event"}})");
  Instruments instruments;
  instruments.events.push_back({"stop", {0, 1}, ObservedEventKind::kStick});
  instruments.events.push_back({"start", {1, 0}, ObservedEventKind::kSlip});
  // t = v / (μ g); the push starts it at 0.6 s, and after it μ g t = (F / m − μ g) 0.1.
  const double g = 9.81;
  const double mu = 0.3;
  const double rate = 5.0 - mu * g;
  Eigen::Vector3d values(1.0 / (mu * g), 0.6, 0.7 + rate * 0.1 / (mu * g));
  RowMatrixXd expected(3, 3);
  // By velocity, mean friction (each body's counts half) and the push.
  expected << 1.0 / (mu * g), -0.5 / (mu * mu * g), 0.0,  //
      0.0, 0.0, 0.0,                                      //
      0.0, -0.5 * 0.5 / (mu * mu * g), 0.1 * 0.5 / (mu * g);
  ExpectDerivatives(
      Residuals(scene, instruments,
                {Parameter("bodies/box/velocity/x", 1.0), Parameter("bodies/box/friction", 0.3),
                 Parameter("forces/push/force/x", 10.0)},
                {EventOf(0, 1, 0.0), EventOf(1, 1, 0.0), EventOf(0, 2, 0.0)}),
      values, expected, 1e-7);
}

TEST(EventTimesTest, ALandingWithoutRestitutionRests) {
  Scene scene = MakeScene(kBouncingBall);
  scene.pairs[0].restitution = 0.0;
  RowMatrixXd expected(1, 1);
  expected << Bounces().ByHeight(1);
  ExpectDerivatives(Residuals(scene, BounceOf(ObservedEventKind::kRest),
                              {Parameter("bodies/ball/position/y", 1.1)}, {EventOf(0, 1, 0.0)}),
                    Eigen::VectorXd::Constant(1, Bounces().Time(1)), expected, 1e-7);
}

TEST(EventTimesTest, ASpringThatIsPulledLiftsABallOff) {
  // k u t = m g.
  const Scene scene = MakeScene(R"({"name": "lifted", "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "hand", "kinematic": true, "position": [0, 2], "velocity": [0, 0.4]}],
    "springs": [{"name": "s", "bodies": ["ball", "hand"], "anchors": [[0, 0.1], [0, 2]],
                 "stiffness": 30, "damping": 0, "rest_length": 1.9}],
    "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  const double t = 9.81 / (30.0 * 0.4);
  RowMatrixXd expected(1, 3);
  expected << -t / 30.0, t, -t / 0.4;
  ExpectDerivatives(
      Residuals(scene, BounceOf(ObservedEventKind::kLiftOff),
                {Parameter("springs/s/stiffness", 30.0), Parameter("bodies/ball/mass", 1.0),
                 Parameter("bodies/hand/velocity/y", 0.4)},
                {EventOf(0, 1, 0.0)}),
      Eigen::VectorXd::Constant(1, t), expected, 1e-7);
}

TEST(EventTimesTest, SamplesAndEventsStandBesideOneAnother) {
  // Derivatives of coordinates are not changed by events, and the run lasts as long as the scene.
  const Scene scene = MakeScene(kBouncingBall);
  Observation place;
  place.time = 0.7;
  place.body = 0;
  place.coordinate = Coordinate::kY;
  const std::vector<FitParameter> height = {Parameter("bodies/ball/position/y", 1.1)};
  RolloutResiduals alone = Residuals(scene, {}, height, {place});
  RolloutResiduals both =
      Residuals(scene, BounceOf(), height, {EventOf(0, 1, 0.4), place, EventOf(0, 3, 1.0)});
  for (const GradientMethod method : kAll) {
    if (!IsAvailable(method)) continue;
    Eigen::VectorXd r, r_both;
    RowMatrixXd jacobian, jacobian_both;
    const Eigen::VectorXd p = alone.scene().Initial();
    ASSERT_TRUE(alone.Evaluate(p, method, &r, &jacobian));
    ASSERT_TRUE(both.Evaluate(p, method, &r_both, &jacobian_both));
    EXPECT_EQ(r[0], r_both[1]) << NameOf(method);
    EXPECT_NEAR(jacobian(0, 0), jacobian_both(1, 0), 1e-9) << NameOf(method);
    EXPECT_NEAR(jacobian_both(2, 0), Bounces().ByHeight(3), 1e-6) << NameOf(method);
  }
}

struct EventFile {
  std::vector<Observation> observations;
  std::string error;
};
EventFile Parse(const std::string& text, const ObservationOptions& options = {}) {
  const Scene scene = MakeScene(kBouncingBall);
  const Instruments instruments = BounceOf();
  std::vector<Channel> channels = {Channel()};
  ObservationSigma sigma;
  sigma.events = {0.25};
  EventFile file;
  ParseObservations(text, "e.csv", {scene, {}, instruments}, sigma, options, &channels,
                    &file.observations, &file.error);
  return file;
}

TEST(EventFileTest, NumbersMayHaveGaps) {
  const EventFile file = Parse("time,event,number\n0.5,bounce,1\n1.5,bounce,4\n");
  ASSERT_EQ(file.error, "");
  ASSERT_EQ(file.observations.size(), 2U);
  EXPECT_EQ(file.observations[1].number, 4);
  EXPECT_EQ(file.observations[1].value, 1.5);
  EXPECT_EQ(file.observations[1].sigma, 0.25);
  EXPECT_EQ(file.observations[1].coordinate, Coordinate::kTime);
}

TEST(EventFileTest, MistakesAreOneLine) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"time,event,number\n1,hit,1\n",
       "e.csv: line 2: event: expected the name of one of the events (bounce), got \"hit\""},
      {"time,event,number\n1,bounce,0\n",
       "e.csv: line 2: number: expected an integer from 1 (the first), got 0"},
      {"time,event,number\n1,bounce,1.5\n",
       "e.csv: line 2: number: expected an integer from 1 (the first), got 1.5"},
      {"time,event,number\n1,bounce,3\n2,bounce,2\n",
       "e.csv: line 3: number: expected more than 3, the last one of bounce, got 2"},
      {"time,event,number\n5,bounce,1\n",
       "e.csv: line 2: time: expected a time within the run, [0, 4] s, got 5"},
      {"time,event,number,x\n1,bounce,1,2\n",
       "e.csv: header: expected time, event and number alone, got x"},
      {"time,event\n1,bounce\n", "e.csv: header: expected a column number, got none"},
      {"time,event,number\n", "e.csv: expected at least one event, got none"}};
  for (const auto& [text, error] : mistakes) EXPECT_EQ(Parse(text).error, error);
  ObservationOptions options;
  options.channel.camera = 0;
  EXPECT_EQ(Parse("time,event,number\n1,bounce,1\n", options).error,
            "e.csv: expected no camera and no relative_to of times of events, got one");
}

}  // namespace
}  // namespace tangible
