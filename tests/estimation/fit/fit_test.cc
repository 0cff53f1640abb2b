// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/observed_state.h"

namespace tangible {
namespace {

FitResult FitTo(const Scene& scene, const std::vector<FitParameter>& parameters,
                const std::vector<Observation>& observations, const FitOptions& options = {}) {
  RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
  return Fit(options, &residuals, {});
}

TEST(FitTest, RecoversGravityAndDampingOfAFallingBall) {
  const Scene scene = MakeScene(kFallingBall);
  const FitResult fit =
      FitTo(scene, {Parameter("gravity/y", -5.0), Parameter("bodies/ball/linear_damping", 0.0)},
            Observe(scene, 5, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], -9.81, 1e-8 * 9.81);
  EXPECT_NEAR(fit.estimate[1], 0.3, 1e-8 * 0.3);
  EXPECT_LE(fit.iterations.size(), 16u);
  EXPECT_EQ(fit.iterations.front().parameters, (std::vector<double>{-5.0, 0.0}));
  EXPECT_EQ(fit.iterations.front().cost, fit.initial_cost);
  EXPECT_GT(fit.rollouts, 0);
}

TEST(FitTest, RecoversFrictionByEveryMethod) {
  const Scene scene = MakeScene(kSlidingBox);
  const std::vector<Observation> observations = Observe(scene, 5, 0.0, 1);
  for (const GradientMethod method :
       {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJet,
        GradientMethod::kJetImplicit, GradientMethod::kFiniteDifference}) {
    if (!IsAvailable(method)) {
      continue;
    }
    FitOptions options;
    options.derivatives = method;
    const FitResult fit =
        FitTo(scene, {Parameter("bodies/box/friction", 0.1)}, observations, options);
    ASSERT_EQ(fit.status, FitStatus::kConverged) << NameOf(method) << ": " << fit.message;
    EXPECT_NEAR(fit.estimate[0], 0.4, 1e-8 * 0.4) << NameOf(method);
  }
}

TEST(FitTest, RecoversAPendulumsStartAndDamping) {
  const Scene scene = MakeScene(kPendulum);
  const FitResult fit =
      FitTo(scene,
            {Parameter("joints/pin/angle", 0.8), Parameter("joints/pin/rate", 0.0),
             Parameter("joints/pin/damping", 0.01), Parameter("gravity/y", -9.0)},
            Observe(scene, 5, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  const Eigen::Vector4d truth(1.0, 0.3, 0.05, -9.81);
  EXPECT_LT((fit.estimate - truth).cwiseQuotient(truth).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(FitTest, AMassThroughContactFromAnyStart) {
  const Scene scene = MakeScene(kSmallChain);
  const std::vector<Observation> noisy = Observe(scene, 5, 0.001, 7);
  std::optional<double> first;
  for (const double start : {0.05, 0.3, 1.0, 7.0, 20.0}) {
    FitParameter mass = Parameter("bodies/link*/mass", start);
    mass.sets[0].scale = 1.0 / 3.0;
    mass.lower = 0.01;
    mass.upper = 100.0;
    const FitResult exact = FitTo(scene, {mass}, Observe(scene, 5, 0.0, 1));
    ASSERT_EQ(exact.status, FitStatus::kConverged) << exact.message;
    EXPECT_NEAR(exact.estimate[0], 2.1, 1e-8 * 2.1) << start;
    const FitResult fit = FitTo(scene, {mass}, noisy);
    ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    EXPECT_LE(fit.iterations.size(), 16u) << start;
    first = first.value_or(fit.estimate[0]);
    EXPECT_NEAR(fit.estimate[0], *first, 1e-9 * *first) << start;
  }
}

TEST(FitTest, IntervalsCoverTheTruthAsOftenAsTheySay) {
  const Scene scene = MakeScene(kFallingBall);
  constexpr int kSeeds = 400;
  int covered = 0;
  double squares = 0.0;
  double chi_squares = 0.0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const FitResult fit =
        FitTo(scene, {Parameter("gravity/y", -9.0), Parameter("bodies/ball/velocity/y", 2.5)},
              Observe(scene, 10, 0.02, 100 + seed));
    ASSERT_EQ(fit.status, FitStatus::kConverged);
    const auto interval = fit.uncertainty.confidence_95[0];
    ASSERT_TRUE(interval);
    covered += interval->first <= -9.81 && -9.81 <= interval->second ? 1 : 0;
    const double score = (fit.estimate[1] - 3.0) / fit.uncertainty.standard_deviation[1];
    squares += score * score;
    chi_squares += fit.uncertainty.reduced_chi_square;
  }
  // Binomial: 0.95 ± 4 sqrt(0.95 0.05 / 400); squares of standard normals: 1 ± 4 sqrt(2 / 400); 33
  // measured coordinates and 2 parameters: 1 ± 4 sqrt(2 / (31 400)).
  EXPECT_NEAR(covered / double{kSeeds}, 0.95, 0.044);
  EXPECT_NEAR(squares / kSeeds, 1.0, 0.283);
  EXPECT_NEAR(chi_squares / kSeeds, 1.0, 0.051);
}

TEST(FitTest, ABoundHoldsAndHasNoInterval) {
  const Scene scene = MakeScene(kSlidingBox);
  FitParameter friction = Parameter("bodies/box/friction", 0.6);
  friction.lower = 0.5;
  friction.upper = 0.9;
  const FitResult fit =
      FitTo(scene, {friction, Parameter("forces/push/force/x", 1.0)}, Observe(scene, 5, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], 0.5, 1e-12);
  EXPECT_FALSE(fit.uncertainty.confidence_95[0]);
  EXPECT_TRUE(fit.uncertainty.confidence_95[1]);
  EXPECT_NE(fit.uncertainty.messages[0].find("lower bound"), std::string::npos);
}

TEST(FitTest, HuberIsNotMovedByOutliers) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations = Observe(scene, 2, 0.01, 5);
  for (size_t i = 1; i < observations.size(); i += 15) {
    observations[i].value += 2.0;
  }
  const FitResult squares = FitTo(scene, {Parameter("gravity/y", -8.0)}, observations);
  FitOptions options;
  options.huber = 2.0;
  const FitResult robust = FitTo(scene, {Parameter("gravity/y", -8.0)}, observations, options);
  ASSERT_EQ(robust.status, FitStatus::kConverged) << robust.message;
  // One outlier in five of y pulls by at most the bound, 2 sigma each: half a standard deviation a
  // coordinate on average.
  const double deviation = robust.uncertainty.standard_deviation[0];
  EXPECT_LT(std::abs(robust.estimate[0] + 9.81), 8.0 * deviation);
  EXPECT_GT(std::abs(squares.estimate[0] + 9.81), 50.0 * deviation);
  // At the minimum of the robust cost its derivative vanishes: a weight for each coordinate, not
  // one for all.
  EXPECT_LT(robust.iterations.back().gradient_norm, 1e-6 * robust.iterations.front().gradient_norm);
}

TEST(FitTest, AParameterWithoutEffectIsNamed) {
  const Scene scene = MakeScene(kFallingBall);
  const FitResult fit =
      FitTo(scene, {Parameter("gravity/y", -9.0), Parameter("bodies/ball/friction", 0.5)},
            Observe(scene, 10, 0.0, 1));
  EXPECT_EQ(fit.status, FitStatus::kNoEffect);
  EXPECT_EQ(fit.parameter, 1);
  EXPECT_NE(fit.message.find("\"bodies/ball/friction\" has no effect"), std::string::npos);
}

// A block on a table slows down by μ g until it stops: its accelerations change with its speed by a
// jump at the time of the stop, so that the speed alone has no derivative, and an effect.
TEST(FitTest, AParameterThatActsByJumpsAloneIsNotWithoutEffect) {
  const Scene scene = MakeScene(R"({"gravity": [0, 0], "bodies": [
      {"name": "block", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0],
       "support": {"friction": 0.2}}],
    "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.8}})");
  std::vector<Observation> observations;
  for (int k = 1; k < 80; ++k) {
    Observation one;
    one.body = 0;
    one.coordinate = Coordinate::kAx;
    one.time = 0.01 * k - 0.005;
    one.value = one.time < 1.0 / (0.2 * 9.81) ? -0.2 * 9.81 : 0.0;
    one.sigma = 0.1;
    observations.push_back(one);
  }
  const FitResult fit = FitTo(scene, {Parameter("bodies/block/velocity/x", 1.3)}, observations);
  EXPECT_EQ(fit.status, FitStatus::kNoEffect);
  EXPECT_NE(fit.message.find("\"bodies/block/velocity/x\" has no derivative"), std::string::npos)
      << fit.message;
}

// A window that ends with the last observation: a later end does nothing, an earlier one does.
TEST(FitTest, AnEndAtTheLastObservationIsNotWithoutEffect) {
  const Scene scene = MakeScene(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
    "forces": [{"name": "f", "body": "a", "force": [3, 0], "end": 0.3}],
    "simulation": {"stepping": "event", "dt": 0.02, "duration": 1}})");
  std::vector<Observation> observations;
  for (const auto& [time, speed] :
       {std::pair(0.1, 0.3), std::pair(0.2, 0.6), std::pair(0.3, 0.75)}) {
    Observation one;
    one.body = 0;
    one.coordinate = Coordinate::kVx;
    one.time = time;
    one.value = speed;
    one.sigma = 0.01;
    observations.push_back(one);
  }
  const FitResult fit = FitTo(scene, {Parameter("forces/f/end", 0.3)}, observations);
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], 0.25, 1e-9);
}

// With more friction than stops a disc's lowest point in its impact it does nothing at the start.
TEST(FitTest, FrictionIsFoundFromAStartAtWhichItSticks) {
  const Scene scene = MakeScene(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.5],
       "velocity": [3, 0]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "pairs": [{"bodies": ["ball", "floor"], "restitution": 0.6, "friction": 0.1}],
      "simulation": {"dt": 0.01, "duration": 0.6, "stepping": "event"}})");
  const FitResult fit =
      FitTo(scene, {Parameter("pairs/ball:floor/friction", 0.9)}, Observe(scene, 1, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], 0.1, 1e-9);
}

// At restitution 0 an impact has another law, and the derivative is 0 by definition.
TEST(FitTest, AParameterWhoseDerivativeVanishesAtItsBoundIsFitted) {
  const Scene scene = MakeScene(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.5]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "pairs": [{"bodies": ["ball", "floor"], "restitution": 0.6}],
      "simulation": {"dt": 0.01, "duration": 0.6}})");
  const FitResult fit =
      FitTo(scene, {Parameter("pairs/ball:floor/restitution", 0.0)}, Observe(scene, 1, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], 0.6, 1e-6);
  // The iterations begin with what the user wrote.
  EXPECT_EQ(fit.iterations.front().parameters, std::vector<double>{0.0});
  EXPECT_EQ(fit.iterations.front().cost, fit.initial_cost);
  EXPECT_EQ(fit.starts.front().initial, std::vector<double>{0.0});
}

TEST(FitTest, HuberConvergesQuicklyFromFarAway) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations = Observe(scene, 2, 0.01, 5);
  for (size_t i = 1; i < observations.size(); i += 15) {
    observations[i].value += 2.0;
  }
  FitOptions options;
  options.huber = 3.0;
  const FitResult near = FitTo(scene, {Parameter("gravity/y", -9.8)}, observations, options);
  for (const double start : {-0.1, -300.0}) {
    const FitResult far = FitTo(scene, {Parameter("gravity/y", start)}, observations, options);
    ASSERT_EQ(far.status, FitStatus::kConverged) << far.message;
    EXPECT_NEAR(far.estimate[0], near.estimate[0], 1e-8);
    EXPECT_NEAR(far.final_cost, near.final_cost, 1e-9 * near.final_cost);
    EXPECT_LE(far.iterations.size(), 16u);
    EXPECT_EQ(far.iterations.back().cost, far.final_cost);
  }
}

TEST(FitTest, ACombinationThatIsNotDeterminedIsNamed) {
  // Only damping / mass enters the motion of a falling ball.
  const Scene scene = MakeScene(kFallingBall);
  const FitResult fit = FitTo(
      scene, {Parameter("bodies/ball/mass", 2.5), Parameter("bodies/ball/linear_damping", 0.2)},
      Observe(scene, 5, 0.0, 1));
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[1] / fit.estimate[0], 0.15, 1e-8);
  EXPECT_FALSE(fit.uncertainty.confidence_95[0]);
  EXPECT_FALSE(fit.uncertainty.confidence_95[1]);
  ASSERT_FALSE(fit.uncertainty.warnings.empty());
  EXPECT_NE(
      fit.uncertainty.warnings[0].find("1 'bodies/ball/mass' + 1 'bodies/ball/linear_damping'"),
      std::string::npos)
      << fit.uncertainty.warnings[0];
}

TEST(FitTest, StartsAreDrawnBySeed) {
  const Scene scene = MakeScene(kSlidingBox);
  FitParameter friction = Parameter("bodies/box/friction", 0.6);
  friction.upper = 2.0;
  FitOptions options;
  options.starts = 3;
  options.seed = 11;
  const std::vector<Observation> observations = Observe(scene, 5, 0.0, 1);
  const FitResult fit = FitTo(scene, {friction}, observations, options);
  ASSERT_EQ(fit.starts.size(), 3u);
  EXPECT_EQ(fit.starts[0].initial[0], 0.6);
  EXPECT_NE(fit.starts[1].initial[0], fit.starts[2].initial[0]);
  EXPECT_EQ(fit.starts[1].initial,
            FitTo(scene, {friction}, observations, options).starts[1].initial);
  EXPECT_NEAR(fit.estimate[0], 0.4, 1e-8);
  options.seed = 12;
  EXPECT_NE(fit.starts[1].initial,
            FitTo(scene, {friction}, observations, options).starts[1].initial);
}

/// A pendulum by events, seen late by an encoder of unknown gain, by a camera that stands anywhere,
/// and by a gyroscope; the run begins 0.1 s before the recording does.
TEST(FitTest, InstrumentsAreFoundBesideThePhysics) {
  Scene scene = MakeScene(kPendulum);
  scene.simulation.stepping = Stepping::kEvent;
  Instruments truth;
  truth.sensors = {{"encoder", 0.0213, 1.05, 0.02}, {"gyroscope", 0.004, 1.0, -0.1}};
  truth.cameras = {{"camera", 650.0, 0.04, {0.1, -0.3}}};
  truth.clocks = {{"clock", 1.002, 0.1}};
  std::vector<Channel> channels(3);
  channels[0] = {.sensor = 0, .clock = 0};
  channels[1] = {.camera = 0, .clock = 0};
  channels[2] = {.sensor = 1, .clock = 0};
  const std::vector<BodyPoint> points = {{"lamp", 0, {0.05, -0.4}}};
  std::vector<Observation> observations;
  for (int k = 0; k <= 180; ++k) {
    const double time = 0.01 * k;
    observations.push_back({time, 0, -1, Coordinate::kAngle, 0.0, 1e-3, 0});
    observations.push_back({time, 0, 0, Coordinate::kX, 0.0, 0.5, 1});
    observations.push_back({time, 0, 0, Coordinate::kY, 0.0, 0.5, 1});
    observations.push_back({time, 0, -1, Coordinate::kOmega, 0.0, 1e-2, 2});
  }
  const auto residuals_of = [&](const Instruments& instruments,
                                const std::vector<FitParameter>& parameters) {
    ParameterizedScene parameterized;
    ParameterError error;
    EXPECT_TRUE(parameterized.Create(scene, points, parameters, &error, instruments)) << error.what;
    return RolloutResiduals(parameterized, observations, channels);
  };
  // The truth's predictions are the observations.
  RolloutResiduals exact = residuals_of(truth, {Parameter("joints/pin/damping", 0.05)});
  Eigen::VectorXd predicted;
  ASSERT_TRUE(
      exact.Evaluate(exact.scene().Initial(), GradientMethod::kTangent, &predicted, nullptr))
      << exact.message();
  for (size_t i = 0; i < observations.size(); ++i) {
    observations[i].value = predicted[static_cast<Eigen::Index>(i)] * observations[i].sigma;
  }
  const std::vector<std::pair<std::string, double>> expected = {
      {"joints/pin/damping", 0.05},       {"joints/pin/angle", 1.0},
      {"sensors/encoder/delay", 0.0213},  {"sensors/encoder/gain", 1.05},
      {"sensors/encoder/bias", 0.02},     {"sensors/gyroscope/bias", -0.1},
      {"sensors/gyroscope/delay", 0.004}, {"cameras/camera/scale", 650.0},
      {"cameras/camera/rotation", 0.04},  {"cameras/camera/origin/x", 0.1},
      {"clocks/clock/rate", 1.002}};
  std::vector<FitParameter> parameters;
  for (const auto& [path, value] : expected) {
    parameters.push_back(Parameter(path, 0.8 * value));
  }
  parameters[7].initial = 600.0;
  parameters.back().initial = 1.0;
  RolloutResiduals residuals = residuals_of(truth, parameters);
  const FitResult result = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  for (size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(result.estimate[static_cast<Eigen::Index>(k)], expected[k].second,
                1e-7 * std::max(1.0, std::abs(expected[k].second)))
        << expected[k].first;
  }
}

/// A body that falls, by a clock that is 0.2 % slow, up to the end of the scene: the last
/// observations are of later times. Its place is x = v t, y = −g t² / 2.
TEST(FitTest, AClockMayShowTimesBehindTheEnd) {
  Scene scene = MakeScene(R"({"gravity": [0, -9.81], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [2, 0]}],
      "simulation": {"dt": 0.01, "duration": 2, "stepping": "event"}})");
  Instruments instruments;
  instruments.clocks = {{"clock", 1.0, 0.0}};
  std::vector<Channel> channels(1);
  channels[0] = {.clock = 0};
  std::vector<Observation> observations;
  for (int k = 0; k <= 200; ++k) {
    const double time = 0.01 * k;
    const double in_run = 1.002 * time;
    observations.push_back({time, 0, -1, Coordinate::kX, 2.0 * in_run, 1e-3, 0});
    observations.push_back({time, 0, -1, Coordinate::kY, -4.905 * in_run * in_run, 1e-3, 0});
  }
  ParameterizedScene parameterized;
  ParameterError error;
  ASSERT_TRUE(parameterized.Create(
      scene, {}, {Parameter("clocks/clock/rate", 1.0), Parameter("bodies/b/velocity/x", 1.9)},
      &error, instruments))
      << error.what;
  RolloutResiduals residuals(parameterized, observations, channels);
  const FitResult result = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  EXPECT_NEAR(result.estimate[0], 1.002, 1e-9);
  EXPECT_NEAR(result.estimate[1], 2.0, 1e-8);
  // A tenth of the run, and no more.
  Eigen::VectorXd late = residuals.scene().Initial();
  Eigen::VectorXd values;
  late[0] = 1.11;
  EXPECT_FALSE(residuals.Evaluate(late, GradientMethod::kTangent, &values, nullptr));
  EXPECT_NE(residuals.message().find("outside of [0, 2.2] s"), std::string::npos)
      << residuals.message();
}

/// A pendulum's lamp, the only thing seen, with an aspect of 1.02 and a lens that moves it outwards
/// by 2 % at half a metre; the fit knows neither, nor where the pendulum begins.
TEST(FitTest, AspectAndLensOfACameraAreFound) {
  const Scene scene = MakeScene(kPendulum);
  const std::vector<BodyPoint> points = {{"lamp", 0, {0.05, -0.4}}};
  Instruments truth;
  truth.cameras = {{"camera", 650.0, 0.04, {0.1, -0.3}, -1, -1, 1.02, 0.02, 0.5}};
  std::vector<Channel> channels(1);
  channels[0].camera = 0;
  std::vector<Observation> observations;
  for (int k = 0; k <= 180; ++k) {
    observations.push_back({0.01 * k, 0, 0, Coordinate::kX, 0.0, 0.5, 0});
    observations.push_back({0.01 * k, 0, 0, Coordinate::kY, 0.0, 0.5, 0});
  }
  const auto residuals_of = [&](const Instruments& instruments,
                                const std::vector<FitParameter>& parameters) {
    ParameterizedScene parameterized;
    ParameterError error;
    EXPECT_TRUE(parameterized.Create(scene, points, parameters, &error, instruments)) << error.what;
    return RolloutResiduals(parameterized, observations, channels);
  };
  RolloutResiduals exact = residuals_of(truth, {Parameter("joints/pin/angle", 1.0)});
  Eigen::VectorXd predicted;
  ASSERT_TRUE(
      exact.Evaluate(exact.scene().Initial(), GradientMethod::kTangent, &predicted, nullptr))
      << exact.message();
  for (size_t i = 0; i < observations.size(); ++i) {
    observations[i].value = predicted[static_cast<Eigen::Index>(i)] * observations[i].sigma;
  }
  // A start from observations undoes the image, to the error of the parabola through the first
  // samples; a camera without aspect and lens begins farther away.
  Instruments ideal;
  ideal.cameras = {{"camera", 650.0, 0.04, {0.1, -0.3}}};
  const auto start = [&](const Instruments& instruments) {
    const RolloutResiduals seen = residuals_of(instruments, {Parameter("joints/pin/angle", 0.8)});
    return ParametersFromObservations(seen, {true})[0];
  };
  EXPECT_NEAR(start(truth), 1.0, 5e-4);
  EXPECT_GT(std::abs(start(ideal) - 1.0), 5e-3);
  const std::vector<std::pair<std::string, double>> expected = {{"cameras/camera/aspect", 1.02},
                                                                {"cameras/camera/radial", 0.02},
                                                                {"cameras/camera/rotation", 0.04},
                                                                {"joints/pin/angle", 1.0}};
  RolloutResiduals residuals = residuals_of(
      truth, {Parameter("cameras/camera/aspect", 1.0), Parameter("cameras/camera/radial", 0.0),
              Parameter("cameras/camera/rotation", 0.0), Parameter("joints/pin/angle", 0.9)});
  const FitResult result = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  for (size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(result.estimate[static_cast<Eigen::Index>(k)], expected[k].second, 1e-8)
        << expected[k].first;
  }
}

// A disc that is too slow at first to reach the wall before its data have turned back: restitution
// has no effect until the speed follows what comes before. x = 2 t, then 1 - 1.4 (t - 0.5).
TEST(FitTest, ARestitutionHasAnEffectOnceTheSpeedFollowsTheData) {
  const Scene scene = MakeScene(R"({"gravity": [0, 0], "bodies": [
    {"name": "p", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
     "velocity": [2, 0]},
    {"name": "w", "static": true, "shape": {"half_plane": {"normal": [-1, 0], "offset": -1.1}}}],
    "pairs": [{"bodies": ["p", "w"], "restitution": 0.7}],
    "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  std::vector<Observation> observations;
  for (int k = 1; k <= 20; ++k) {
    const double t = 0.05 * k;
    observations.push_back(
        {t, 0, -1, Coordinate::kX, t < 0.5 ? 2.0 * t : 1.0 - 1.4 * (t - 0.5), 0.01});
  }
  for (const double initial : {0.5, 0.8, 0.99}) {
    RolloutResiduals residuals = MakeResiduals(
        scene, {},
        {Parameter("bodies/p/velocity/x", initial), Parameter("pairs/p:w/restitution", 0.5)},
        observations);
    const FitResult fit = Fit(FitOptions(), &residuals, {});
    EXPECT_EQ(fit.status, FitStatus::kConverged) << initial << ": " << fit.message;
    ASSERT_EQ(fit.estimate.size(), 2) << initial;
    EXPECT_NEAR(fit.estimate[0], 2.0, 1e-6) << initial;
    EXPECT_NEAR(fit.estimate[1], 0.7, 1e-6) << initial;
  }
}

}  // namespace
}  // namespace tangible
