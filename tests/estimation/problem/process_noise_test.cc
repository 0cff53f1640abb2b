// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/process_noise.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/noise_intensity.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {
namespace {

constexpr char kSlider[] = R"({"name": "slider", "bodies": [
  {"name": "ball", "mass": 2, "inertia": 1, "position": [0, 0], "linear_damping": 0.3}],
  "joints": [{"name": "rail", "type": "prismatic", "bodies": ["ball", "world"], "anchor": [0, 0],
              "axis": [1, 0], "displacement": 0.4, "rate": 0.2, "stiffness": 8, "rest_displacement": 0.1}],
  "simulation": {"dt": 0.02, "duration": 2, "joint_correction": "none"}})";

NoiseTerm OnJoint(const std::string& joint, NoiseCoordinate coordinate,
                  std::optional<double> intensity, double correlation_time = 0.0) {
  NoiseTerm term;
  term.joint = joint;
  term.coordinate = coordinate;
  term.intensity = intensity;
  term.correlation_time = correlation_time;
  return term;
}

NoiseTerm OnBody(const std::string& body, NoiseCoordinate coordinate,
                 std::optional<double> intensity, double correlation_time = 0.0) {
  NoiseTerm term = OnJoint("", coordinate, intensity, correlation_time);
  term.body = body;
  return term;
}

/// The state [x, v] after a step of the slider from [x, v] with a force.
Eigen::Vector2d StepOf(const Scene& scene, const Eigen::Vector2d& from, double force) {
  Scene driven = scene;
  driven.joints[0].angle = from[0];
  driven.joints[0].rate = from[1];
  driven.joints[0].effort = force;
  driven.simulation.duration = driven.simulation.dt;
  Model<double> model;
  State<double> state;
  BuildModel(driven, &model, &state);
  State<double> final;
  EXPECT_EQ(Rollout(model, state, {}, &final).status, StepStatus::kDone);
  return {final.pose[0], final.twist[0]};
}

/// A Kalman filter with the smoother of Rauch, Tung and Striebel, of z = [x, v, u] with the force
/// size · u, u⁺ = decay u + drive ε.
struct Kalman {
  double minus_log = 0.0;
  std::vector<Eigen::Vector3d> smoothed;
  std::vector<Eigen::Matrix3d> covariances;
};

Kalman SmoothByKalman(const Scene& scene, const std::vector<double>& seen, double sigma,
                      const Eigen::Vector2d& mean, const Eigen::Vector2d& deviation, double size,
                      double decay) {
  const Eigen::Vector2d rest = StepOf(scene, Eigen::Vector2d::Zero(), 0.0);
  Eigen::Matrix2d a;
  a << StepOf(scene, {1, 0}, 0.0) - rest, StepOf(scene, {0, 1}, 0.0) - rest;
  const Eigen::Vector2d b = StepOf(scene, {0, 0}, 1.0) - rest;
  Kalman result;
  Eigen::Vector3d z(mean[0], mean[1], 0.0);
  Eigen::Matrix3d p = Eigen::Matrix3d::Zero();
  p(0, 0) = deviation[0] * deviation[0];
  p(1, 1) = deviation[1] * deviation[1];
  std::vector<Eigen::Vector3d> filtered, predicted;
  std::vector<Eigen::Matrix3d> filtered_p, predicted_p, maps;
  for (size_t k = 0; k < seen.size(); ++k) {
    predicted.push_back(z);
    predicted_p.push_back(p);
    const double s = p(0, 0) + sigma * sigma;
    const double e = seen[k] - z[0];
    result.minus_log += 0.5 * (std::log(s) + e * e / s);
    const Eigen::Vector3d gain = p.col(0) / s;
    z += gain * e;
    p -= (gain * p.row(0)).eval();
    filtered.push_back(z);
    filtered_p.push_back(p);
    // The force of the next step follows that of the last one; the first has the variance 1.
    const double rho = k == 0 ? 0.0 : decay;
    const double drive = std::sqrt(1.0 - rho * rho);
    Eigen::Matrix3d map = Eigen::Matrix3d::Zero();
    map.topLeftCorner<2, 2>() = a;
    map.topRightCorner<2, 1>() = b * size * rho;
    map(2, 2) = rho;
    Eigen::Vector3d noise;
    noise << b * size * drive, drive;
    maps.push_back(map);
    z = (map * z).eval();
    z.head<2>() += rest;
    p = (map * p * map.transpose() + noise * noise.transpose()).eval();
  }
  result.smoothed = filtered;
  result.covariances = filtered_p;
  for (size_t k = seen.size() - 1; k-- > 0;) {
    const Eigen::Matrix3d c = filtered_p[k] * maps[k].transpose() * predicted_p[k + 1].inverse();
    result.smoothed[k] += c * (result.smoothed[k + 1] - predicted[k + 1]);
    result.covariances[k] += c * (result.covariances[k + 1] - predicted_p[k + 1]) * c.transpose();
  }
  return result;
}

/// A slider that is pushed at random, observed at each step.
struct Pushed {
  static constexpr double kSigma = 0.01;
  Scene scene = MakeScene(kSlider);
  std::vector<double> seen;
  std::vector<Observation> observations;

  explicit Pushed(double size, double decay, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    Eigen::Vector2d x(0.4, 0.2);
    double u = normal(random);
    for (int k = 0; k <= 100; ++k) {
      seen.push_back(x[0] + kSigma * normal(random));
      observations.push_back({0.02 * k, 0, -1, Coordinate::kX, seen.back(), kSigma});
      x = StepOf(scene, x, size * u);
      u = decay * u + std::sqrt(1.0 - decay * decay) * normal(random);
    }
  }

  std::unique_ptr<RecordingsProblem> Problem(const NoiseTerm& term) const {
    FitProblem problem;
    problem.scene = scene;
    problem.observations = observations;
    problem.process_noise = {term};
    problem.parameters = {Parameter("joints/rail/displacement", 0.3),
                          Parameter("joints/rail/rate", 0.0)};
    problem.parameters[0].prior = {PriorKind::kGaussian, 0.35, 0.1};
    problem.parameters[1].prior = {PriorKind::kGaussian, 0.1, 0.3};
    ParameterError error;
    int fault = 0;
    std::unique_ptr<RecordingsProblem> made = MakeProblem(InputOf(problem), &error, &fault);
    EXPECT_NE(made, nullptr) << error.what;
    return made;
  }
};

TEST(ProcessNoiseTest, SmoothesAsKalmanDoes) {
  for (const double time : {0.0, 0.3}) {
    const double intensity = time == 0.0 ? 0.4 : 3.0;  // N √s, N
    const double size = time == 0.0 ? intensity / std::sqrt(0.02) : intensity;
    const double decay = time == 0.0 ? 0.0 : std::exp(-0.02 / time);
    const Pushed pushed(size, decay, 3);
    const std::unique_ptr<RecordingsProblem> problem =
        pushed.Problem(OnJoint("rail", NoiseCoordinate::kDisplacement, intensity, time));
    VarianceComponents components;
    const FitResult result = FitWithComponents(FitOptions(), problem.get(), {}, &components);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    ASSERT_EQ(components.smoothed.size(), 1u);
    const SmoothedRun& run = components.smoothed[0];
    const Kalman kalman = SmoothByKalman(pushed.scene, pushed.seen, Pushed::kSigma, {0.35, 0.1},
                                         {0.1, 0.3}, size, decay);
    ASSERT_EQ(run.states.rows(), 101);
    for (Eigen::Index k = 0; k <= 100; ++k) {
      const size_t at = static_cast<size_t>(k);
      EXPECT_NEAR(run.states(k, 0), kalman.smoothed[at][0], 1e-9) << time << " " << k;
      EXPECT_NEAR(run.states(k, 3), kalman.smoothed[at][1], 1e-9);
      EXPECT_NEAR(run.state_deviations(k, 0), std::sqrt(kalman.covariances[at](0, 0)), 1e-9);
      EXPECT_NEAR(run.state_deviations(k, 3), std::sqrt(kalman.covariances[at](1, 1)), 1e-9);
      if (k == 100) continue;
      EXPECT_NEAR(run.forces(k, 0), size * kalman.smoothed[at + 1][2], 1e-8);
      EXPECT_NEAR(run.force_deviations(k, 0), size * std::sqrt(kalman.covariances[at + 1](2, 2)),
                  1e-8);
    }
    EXPECT_NEAR(result.estimate[0], kalman.smoothed[0][0], 1e-9);
    EXPECT_NEAR(result.uncertainty.standard_deviation[0], std::sqrt(kalman.covariances[0](0, 0)),
                1e-9);

    // The likelihood of any intensity: 1/2 ln det of the noise of observations and of the prior are
    // constants that it leaves out.
    NoiseLikelihood likelihood;
    std::string message;
    ASSERT_TRUE(likelihood.Create(FitOptions(), result.estimate, NoiseLikelihood::Parameters::kFree,
                                  problem.get(), &message))
        << message;
    const double constant = 101.0 * std::log(Pushed::kSigma) + std::log(0.1) + std::log(0.3);
    for (const double factor : {0.3, 1.0, 4.0}) {
      const Eigen::VectorXd s = Eigen::VectorXd::Constant(1, factor * intensity);
      const auto by_kalman = [&](double scale) {
        return SmoothByKalman(pushed.scene, pushed.seen, Pushed::kSigma, {0.35, 0.1}, {0.1, 0.3},
                              scale * size, decay)
            .minus_log;
      };
      const NoiseLikelihood::Value value = likelihood.At(s);
      EXPECT_NEAR(value.minus_log + constant, by_kalman(factor), 1e-9 * 101.0) << factor;
      const double h = 1e-4;
      const double difference =
          (by_kalman(factor * std::exp(h)) - by_kalman(factor * std::exp(-h))) / (2.0 * h);
      EXPECT_NE(value.score[0], 0.0);
      EXPECT_NEAR(value.score[0], difference, 1e-5 * 101.0) << factor;
    }
  }
}

TEST(ProcessNoiseTest, TheEstimatedIntensityHasTheLargestLikelihood) {
  for (const double time : {0.0, 0.3}) {
    const double size = 3.0;
    const double decay = time == 0.0 ? 0.0 : std::exp(-0.02 / time);
    const Pushed pushed(size, decay, 5);
    const std::unique_ptr<RecordingsProblem> problem =
        pushed.Problem(OnJoint("rail", NoiseCoordinate::kDisplacement, std::nullopt, time));
    VarianceComponents components;
    const FitResult result = FitWithComponents(FitOptions(), problem.get(), {}, &components);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const NoiseIntensity& found = components.forces[0];
    ASSERT_TRUE(found.interval);
    const double factor = time == 0.0 ? 1.0 / std::sqrt(0.02) : 1.0;
    const auto by_kalman = [&](double scale) {
      return SmoothByKalman(pushed.scene, pushed.seen, Pushed::kSigma, {0.35, 0.1}, {0.1, 0.3},
                            scale * factor * found.intensity, decay)
          .minus_log;
    };
    const double least = by_kalman(1.0);
    EXPECT_LT(least, by_kalman(1.01));
    EXPECT_LT(least, by_kalman(0.99));
    EXPECT_LT(found.interval->first, size / factor);
    EXPECT_GT(found.interval->second, size / factor);
    // The deviation is that of the curvature.
    const double h = 0.05;
    const double curvature =
        (by_kalman(std::exp(h)) - 2.0 * least + by_kalman(std::exp(-h))) / (h * h);
    const double deviation = std::log(found.interval->second / found.intensity) / 1.959964;
    EXPECT_NEAR(deviation * std::sqrt(curvature), 1.0, 0.1);
  }
}

/// The least cost over the forces, and its gradient.
double CostAt(RolloutResiduals* run, const Eigen::VectorXd& p, double huber,
              Eigen::VectorXd* gradient) {
  BlockEvaluation block;
  EXPECT_TRUE(
      run->EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &block))
      << block.message;
  double cost = 0.0;
  Eigen::VectorXd pull = block.residuals;
  for (Eigen::Index i = 0; i < pull.size(); ++i) {
    const double size = std::abs(pull[i]);
    const bool far = huber > 0.0 && size > huber && i < run->num_residuals();
    cost += far ? huber * size - 0.5 * huber * huber : 0.5 * pull[i] * pull[i];
    if (far) pull[i] *= huber / size;
  }
  *gradient = block.jacobian.transpose() * pull;
  return cost;
}

void ExpectGradient(const std::string& text, const std::vector<FitParameter>& parameters,
                    const std::vector<NoiseTerm>& terms, double huber) {
  Scene scene = MakeScene(text);
  FitProblem problem;
  problem.scene = scene;
  problem.observations = Observe(scene, 3, 0.02, 4);
  problem.parameters = parameters;
  problem.process_noise = terms;
  ParameterError error;
  std::optional<RolloutResiduals> run = MakeRun(problem, &error);
  ASSERT_TRUE(run) << error.what;
  run->SetHuber(huber);
  const Eigen::VectorXd p = run->scene().Initial();
  Eigen::VectorXd gradient, unused;
  CostAt(&*run, p, huber, &gradient);
  EXPECT_GT(run->noise()->path().forces.norm(), 0.0);
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    double last = 0.0;
    for (const double step : {1e-5, 1e-6}) {
      const double h = step * std::max(1e-2, std::abs(p[k]));
      Eigen::VectorXd beside = p;
      beside[k] = p[k] + h;
      const double up = CostAt(&*run, beside, huber, &unused);
      beside[k] = p[k] - h;
      const double down = CostAt(&*run, beside, huber, &unused);
      last = (up - down) / (2.0 * h);
      EXPECT_NEAR(last, gradient[k], 2e-4 * std::max(1.0, gradient.cwiseAbs().maxCoeff()))
          << text.substr(0, 30) << " " << parameters[static_cast<size_t>(k)].name;
    }
    EXPECT_NE(gradient[k], 0.0);
  }
}

TEST(ProcessNoiseTest, TheGradientIsThatOfTheLeastCost) {
  const std::vector<FitParameter> pendulum = {
      Parameter("joints/pin/angle", 1.05), Parameter("joints/pin/rate", 0.2),
      Parameter("bodies/bob/inertia", 0.03), Parameter("joints/pin/damping", 0.08)};
  for (const double huber : {0.0, 1.5}) {
    ExpectGradient(kPendulum, pendulum, {OnJoint("pin", NoiseCoordinate::kAngle, 0.3)}, huber);
    ExpectGradient(
        kPendulum, pendulum,
        {OnBody("bob", NoiseCoordinate::kX, 0.5, 0.2), OnBody("bob", NoiseCoordinate::kAngle, 0.1)},
        huber);
  }
  // Through contact.
  ExpectGradient(kSlidingBox,
                 {Parameter("bodies/box/velocity/x", 2.9), Parameter("forces/push/force/x", 1.6)},
                 {OnBody("box", NoiseCoordinate::kX, 0.5)}, 0.0);
}

// A correlation time far below a step makes a white force of intensity s √(2 τ), one of a step a
// process whose means over steps are less than its values.
TEST(ProcessNoiseTest, AShortCorrelationTimeIsThatOfMeans) {
  const Pushed pushed(0.4 / std::sqrt(0.02), 0.0, 3);
  const auto deviation = [&](double intensity, double time) {
    const std::unique_ptr<RecordingsProblem> problem =
        pushed.Problem(OnJoint("rail", NoiseCoordinate::kDisplacement, intensity, time));
    VarianceComponents components;
    const FitResult result = FitWithComponents(FitOptions(), problem.get(), {}, &components);
    EXPECT_EQ(result.status, FitStatus::kConverged) << result.message;
    return result.uncertainty.standard_deviation[1];
  };
  const double white = deviation(0.4, 0.0);
  EXPECT_NEAR(deviation(0.4 / std::sqrt(2e-6), 1e-6), white, 1e-3 * white);
  EXPECT_NEAR(deviation(0.4 / std::sqrt(2e-3), 1e-3), white, 0.1 * white);
}

TEST(ProcessNoiseTest, EventStepping) {
  std::string text = kPendulum;
  text.replace(text.find("\"joint_correction\": \"projection\""), 32, "\"stepping\": \"event\"");
  ExpectGradient(text, {Parameter("joints/pin/angle", 1.05), Parameter("bodies/bob/inertia", 0.03)},
                 {OnJoint("pin", NoiseCoordinate::kAngle, 0.3)}, 0.0);
}

TEST(ProcessNoiseTest, WhatIsWrongIsSaid) {
  const Scene scene = MakeScene(kSlidingBox);
  const auto fault = [&](const std::vector<NoiseTerm>& terms) {
    const std::optional<NoiseFault> found = CheckNoise(terms, scene);
    return found ? found->key + ": " + found->what : "";
  };
  const NoiseTerm good = OnBody("box", NoiseCoordinate::kX, 1.0);
  EXPECT_EQ(fault({good}), "");
  EXPECT_EQ(fault({OnBody("crate", NoiseCoordinate::kX, 1.0)}),
            "body: expected a body of the scene, got crate");
  EXPECT_EQ(fault({OnBody("floor", NoiseCoordinate::kX, 1.0)}),
            "body: expected a moving body, got floor, which no force moves");
  EXPECT_EQ(fault({OnJoint("pin", NoiseCoordinate::kAngle, 1.0)}),
            "joint: expected a joint of the scene, got pin");
  EXPECT_EQ(fault({OnBody("box", NoiseCoordinate::kDisplacement, 1.0)}),
            "coordinate: expected x, y or angle of a body, got displacement");
  NoiseTerm both = good;
  both.joint = "pin";
  EXPECT_EQ(fault({both}), ": expected one of body and joint, got both");
  EXPECT_EQ(fault({good, good}), ": expected each force once, got body 'box' x twice");
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(fault({OnBody("box", NoiseCoordinate::kX, bad)}),
              "intensity: expected a number > 0 or \"estimate\"");
  }
  EXPECT_EQ(fault({OnBody("box", NoiseCoordinate::kX, 1.0, std::nan(""))}),
            "correlation_time: expected a number >= 0");
}

}  // namespace
}  // namespace tangible
