// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/state_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../support/scenes.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

constexpr double kTimeStep = 0.02;

Scene FreeDisc() {
  return SceneOf(R"({"bodies": [{"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 2,
      "position": [0, 1], "velocity": [0.5, 1], "angular_velocity": 3}],
      "forces": [{"name": "f", "body": "disc", "force": [0, 0], "at": [0.05, 0]}],
      "simulation": {"dt": 0.02, "duration": 1}})");
}

// A rod on a hinge, which hangs at an angle; it is placed at `angle`, and the hinge at the origin.
Scene Rod(const char* angle, const char* stepping) {
  return SceneOf(std::string(R"({"bodies": [
      {"name": "rod", "shape": {"box": {"size": [0.05, 1]}}, "mass": 0.8, "position": [0, -0.5]}],
      "joints": [{"name": "hinge", "type": "revolute", "bodies": ["rod", "world"],
                  "anchor": [0, 0], "damping": 0.02, "angle": )") +
                 angle + R"(}], "simulation": {"dt": 0.02, "duration": 1, "stepping": ")" +
                 stepping + "\"}}");
}

CostTerm Number(int index) { return {CostTerm::Kind::kState, index}; }

FilterOptions Options(std::vector<CostTerm> sensors, std::vector<double> sigma) {
  FilterOptions options;
  options.sensors = std::move(sensors);
  options.sigma =
      Eigen::Map<const VectorX<double>>(sigma.data(), static_cast<Eigen::Index>(sigma.size()));
  return options;
}

VectorX<double> Noise(const VectorX<double>& sigma, std::mt19937_64* random) {
  VectorX<double> noise(sigma.size());
  for (double& x : noise) x = Normal(random);
  return noise.cwiseProduct(sigma);
}

// Where a step is linear the filter is the least-squares estimate of the last state from the prior
// and all observations, which is made here at once.
TEST(StateFilter, OfAFreeBodyIsTheLeastSquaresEstimateFromAllObservations) {
  RolloutFunction function;
  ASSERT_EQ(function.Create(FreeDisc(), {}, {"forces/f/force/y"}, {}), "");
  EngineStep model(function);
  FilterOptions options = Options({Number(0), Number(1), Number(2)}, {0.01, 0.03, 0.02});
  options.acceleration_sigma = 0.0;
  options.initial_sigma = 0.4;
  StateFilter filter(&model, kTimeStep, options);
  const VectorX<double> initial = model.initial(), u = VectorX<double>::Zero(1);
  VectorX<double> truth = initial + 0.3 * VectorX<double>::Ones(6);
  std::mt19937_64 random = Generator(1, 0);
  // The information on x₀, and the state and the Jacobian that the model has from its own x₀.
  MatrixX<double> information = MatrixX<double>::Identity(6, 6) / (0.4 * 0.4);
  VectorX<double> right = VectorX<double>::Zero(6), next, nominal = initial;
  MatrixX<double> by_initial = MatrixX<double>::Identity(6, 6), a, b;
  std::string error;
  for (long k = 0; k < 20; ++k) {
    const VectorX<double> observed = filter.Read(truth) + Noise(options.sigma, &random);
    const MatrixX<double> h = by_initial.topRows(3);
    const VectorX<double> weight = options.sigma.cwiseAbs2().cwiseInverse();
    information += h.transpose() * weight.asDiagonal() * h;
    right += h.transpose() * weight.cwiseProduct(observed - nominal.head(3));
    filter.Correct(k, observed);
    const VectorX<double> at_once = nominal + by_initial * information.llt().solve(right);
    EXPECT_LE((filter.state() - at_once).lpNorm<Eigen::Infinity>(), 1e-9) << k;
    const MatrixX<double> spread = by_initial * information.inverse() * by_initial.transpose();
    EXPECT_LE((filter.covariance() - spread).lpNorm<Eigen::Infinity>(), 1e-9) << k;
    ASSERT_TRUE(filter.Advance(k, u, &error)) << error;
    ASSERT_TRUE(model.Step(k, truth, u, &next, &error)) << error;
    truth = next;
    ASSERT_TRUE(model.Linearise(k, nominal, u, &next, &a, &b, &error)) << error;
    nominal = next;
    by_initial = a * by_initial;
  }
}

// The rod swings from elsewhere than the model expects: what surprises, and the errors by their
// covariance, are as they should be, over 40 runs, from the angle and from a point.
TEST(StateFilter, OfARodIsAsGoodAsItSays) {
  CostTerm tip{CostTerm::Kind::kPoint, 0, 0, {0.0, -0.5}};
  CostTerm tip_y = tip;
  tip_y.axis = 1;
  for (const char* stepping : {"fixed", "event"}) {
    for (const std::vector<CostTerm>& sensors :
         {std::vector<CostTerm>{Number(2)}, std::vector<CostTerm>{tip, tip_y}}) {
      RolloutFunction of_model;
      ASSERT_EQ(of_model.Create(Rod("1", stepping), {}, {"joints/hinge/effort"}, {}), "");
      EngineStep model(of_model);
      const VectorX<double> u = VectorX<double>::Zero(1);
      double surprise = 0.0, angle = 0.0, rate = 0.0;
      constexpr int kRuns = 40, kSteps = 25;
      for (unsigned run = 0; run < kRuns; ++run) {
        std::mt19937_64 random = Generator(7, run);
        FilterOptions options = Options(sensors, std::vector<double>(sensors.size(), 1e-4));
        options.initial_sigma = 5e-4;
        options.acceleration_sigma = 0.0;
        StateFilter filter(&model, kTimeStep, options);
        VectorX<double> truth = model.initial(), next;
        // As the prior says: of a rod's end on a hinge, along the joint alone.
        const MatrixX<double> onto = model.JointProjector(0, truth);
        truth += onto * Noise(VectorX<double>::Constant(6, 5e-4), &random);
        double off_joints = 0.0;
        model.ProjectOntoJoints(0, &truth, &off_joints);
        std::string error;
        for (long k = 0; k < kSteps; ++k) {
          filter.Correct(k, filter.Read(truth) + Noise(options.sigma, &random));
          surprise += filter.surprise() / static_cast<double>(sensors.size());
          // The covariance is that of motions which the hinge allows.
          const MatrixX<double> off =
              filter.covariance() - model.JointProjector(k, filter.state()) * filter.covariance();
          EXPECT_LE(off.topRows(3).lpNorm<Eigen::Infinity>(),
                    0.05 * filter.covariance().lpNorm<Eigen::Infinity>());
          ASSERT_TRUE(filter.Advance(k, u, &error)) << error;
          ASSERT_TRUE(model.Step(k, truth, u, &next, &error)) << error;
          truth = next;
        }
        const auto share = [&](int i) {
          return std::pow(filter.state()[i] - truth[i], 2) / filter.covariance()(i, i);
        };
        angle += share(2) / kRuns;
        rate += share(5) / kRuns;
      }
      // Means of chi-squares, whose standard deviation is √(2 / n): of 1000 (or 2000) numbers, with
      // what neighbours share, and of 40. Both within 3 of these.
      EXPECT_NEAR(surprise / (kRuns * kSteps), 1.0, 0.15) << stepping << sensors.size();
      EXPECT_NEAR(angle, 1.0, 0.6) << stepping << sensors.size();
      EXPECT_NEAR(rate, 1.0, 0.6) << stepping << sensors.size();
    }
  }
}

// A random acceleration of a free body adds σ² h² to the variance of a speed in each step.
TEST(StateFilter, ARandomAccelerationSpreadsTheSpeeds) {
  RolloutFunction function;
  ASSERT_EQ(function.Create(FreeDisc(), {}, {"forces/f/force/y"}, {}), "");
  EngineStep model(function);
  FilterOptions options = Options({Number(0)}, {0.01});
  options.initial_sigma = 0.0;
  options.acceleration_sigma = 3.0;
  StateFilter filter(&model, kTimeStep, options);
  std::string error;
  for (long k = 0; k < 10; ++k) {
    ASSERT_TRUE(filter.Advance(k, VectorX<double>::Zero(1), &error)) << error;
  }
  const double a_step = std::pow(3.0 * kTimeStep, 2);
  EXPECT_NEAR(filter.covariance()(3, 3), 10 * a_step, 1e-12);
  EXPECT_NEAR(filter.covariance()(5, 5), 10 * a_step, 1e-12);
}

}  // namespace
}  // namespace tangible
