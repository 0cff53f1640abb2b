// SPDX-License-Identifier: Apache-2.0
//
// The main job: the mass of a chain from its observed motion after a ball has hit it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "../../support/thorough.h"
#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {
namespace {

constexpr double kMass = 7.0;
constexpr double kNoise = 0.001;  // m
const double kStarts[] = {0.07, 0.7, 1.0, 20.0, 70.0};
// The bounds that the fit must keep: iterations and seconds of CPU (a fit takes 0.2 s on the
// machine of the README).
constexpr int kMaxIterations = 15;
constexpr double kMaxSeconds = 2.0;

FitProblem LoadProblem(const std::string& name) {
  FitFile file;
  std::string error;
  EXPECT_TRUE(LoadFit(std::string(TANGIBLE_SOURCE_DIR) + "/data/fits/" + name, &file, &error))
      << error;
  return file.run();
}

FitResult RunFit(const FitProblem& problem) {
  std::string error;
  const std::unique_ptr<RecordingsProblem> made = MakeProblem({"", InputOf(problem), {}}, &error);
  EXPECT_NE(made, nullptr) << error;
  return Fit(problem.options, made.get(), FitProgress());
}

// Replaces every observed value by what the scene predicts at the true mass, which is that of the
// scene file.
void MakeExact(FitProblem* problem) {
  Model<double> model;
  State<double> initial, final;
  BuildModel(problem->scene, &model, &initial);
  std::vector<std::vector<double>> poses;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long, double, const State<double>& state, Stepper*) { poses.push_back(state.pose); },
      &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  const double dt = problem->scene.simulation.dt;
  for (Observation& observation : problem->observations) {
    const size_t k = std::lround(observation.time / dt);
    ASSERT_NEAR(k * dt, observation.time, 1e-9);
    observation.value =
        poses[k][3 * observation.body + (observation.coordinate == Coordinate::kX ? 0 : 1)];
  }
}

void AddNoise(unsigned seed, FitProblem* problem) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  for (Observation& observation : problem->observations) {
    observation.value += noise(generator);
  }
}

// Plain squares lead the way, then Newton's method: with a hundredth of the true sigma nearly all
// residuals stay in the loss's linear part, in which Gauss-Newton creeps.
TEST(ChainFit, HuberConvergesFromFarStarts) {
  FitProblem problem = LoadProblem("chain.json");
  problem.options.huber = 3.0;
  for (Observation& observation : problem.observations) {
    observation.sigma = 0.01 * kNoise;
  }
  problem.parameters[0].initial = kMass;
  const FitResult near = RunFit(problem);
  ASSERT_EQ(near.status, FitStatus::kConverged) << near.message;
  for (const double start : {0.07, 70.0}) {
    problem.parameters[0].initial = start;
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    EXPECT_NEAR(result.estimate(0), near.estimate(0), 1e-8 * kMass) << "from " << start;
    EXPECT_NEAR(result.final_cost, near.final_cost, 1e-9 * near.final_cost);
    EXPECT_LE(static_cast<int>(result.iterations.size()) - 1, kMaxIterations) << "from " << start;
  }
}

TEST(ChainFit, ExactObservationsGiveTheMassFromEveryStart) {
  FitProblem problem = LoadProblem("chain.json");
  MakeExact(&problem);
  for (const double start : kStarts) {
    problem.parameters[0].initial = start;
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    EXPECT_NEAR(result.estimate(0), kMass, 1e-8 * kMass) << "from " << start;
    EXPECT_LE(static_cast<int>(result.iterations.size()) - 1, kMaxIterations);
  }
}

TEST(ChainFit, NoisyObservationsGiveOneEstimateFromEveryStart) {
  FitProblem problem = LoadProblem("chain.json");
  const FitResult reference = RunFit(problem);
  ASSERT_EQ(reference.status, FitStatus::kConverged);
  for (const double start : kStarts) {
    problem.parameters[0].initial = start;
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    // Well within what the noise leaves open: 1e-4 standard deviations.
    EXPECT_NEAR(result.estimate(0), reference.estimate(0),
                1e-4 * reference.uncertainty.standard_deviation(0));
    EXPECT_LE(static_cast<int>(result.iterations.size()) - 1, kMaxIterations);
    EXPECT_LE(result.seconds, kMaxSeconds) << "wall time, start " << start;
  }
  EXPECT_NEAR(reference.estimate(0), kMass, 4.0 * reference.uncertainty.standard_deviation(0));
}

// Of 100 intervals of 95 % between 90 and 99 contain the truth with probability 0.98.
TEST(ChainFit, IntervalsCoverTheMass) {
  FitProblem exact = LoadProblem("chain.json");
  MakeExact(&exact);
  exact.parameters[0].initial = 5.0;
  exact.options.certificate = CertificatePass::kSkip;
  int covered = 0;
  double sum = 0.0;
  double sum_of_squares = 0.0;
  double stated = 0.0;
  const int replicas = testing::Thorough() ? 100 : 30;
  for (unsigned seed = 1; seed <= static_cast<unsigned>(replicas); ++seed) {
    FitProblem problem = exact;
    AddNoise(seed, &problem);
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const double error = result.estimate(0) - kMass;
    stated = result.uncertainty.standard_deviation(0);
    covered += std::abs(error) <= 1.959964 * stated ? 1 : 0;
    sum += error;
    sum_of_squares += error * error;
  }
  std::printf("covered %d of %d; mean error %.2e kg, standard deviation %.2e kg (stated %.2e kg)\n",
              covered, replicas, sum / replicas, std::sqrt(sum_of_squares / replicas), stated);
  EXPECT_GE(covered, 0.9 * replicas);
  EXPECT_LE(covered, replicas == 100 ? 99 : replicas);
}

// The observations of the finer step (dt / 400) are nearly those of the physics: the estimate is
// off in proportion to dt, and the fit at half the step foretells by how much.
TEST(ChainFit, ErrorFallsInProportionToTheStep) {
  FitProblem problem = LoadProblem("chain_fine.json");
  const double steps[] = {0.004, 0.002, 0.001};
  const double fine_step = 5e-6;
  double previous = 0.0;
  for (const double dt : steps) {
    problem.scene.simulation.dt = dt;
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const double error = result.estimate(0) - kMass;
    const DiscretisationCheck check = CheckDiscretisation(InputOf(problem), {}, result);
    ASSERT_EQ(check.status, FitStatus::kConverged) << check.message;
    std::printf("dt %.4f s: mass %.6f kg, error %+.6f kg, predicted %+.6f kg\n", dt,
                result.estimate(0), error, check.bias(0));
    // The data's own step shifts them too: predicted is the distance from dt = 0, the error that
    // from dt = 5e-6.
    EXPECT_NEAR(error, check.bias(0) * (dt - fine_step) / dt, 0.05 * std::abs(error));
    if (previous != 0.0) {
      EXPECT_NEAR(previous / error, (2.0 * dt - fine_step) / (dt - fine_step), 0.1);
    }
    previous = error;
  }
}

// With the impact located in time, and fourth order between, the same step of 2 ms has no bias: the
// interval holds the mass from every start, where fixed steps end 200 standard deviations away.
TEST(ChainFit, EventSteppingIsNotBiasedByItsStep) {
  FitProblem problem = LoadProblem("chain_event.json");
  ASSERT_EQ(problem.scene.simulation.stepping, Stepping::kEvent);
  for (const double start : {0.07, 70.0}) {
    problem.parameters[0].initial = start;
    const FitResult result = RunFit(problem);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const auto& interval = result.uncertainty.confidence_95[0];
    ASSERT_TRUE(interval.has_value());
    EXPECT_LE(interval->first, kMass) << "from " << start;
    EXPECT_GE(interval->second, kMass) << "from " << start;
    // As narrow as with fixed steps: the data determine the mass, not the stepping.
    EXPECT_NEAR(result.uncertainty.standard_deviation(0), 5.3e-4, 0.1e-4);
    EXPECT_NEAR(result.uncertainty.reduced_chi_square, 1.0, 0.05);
  }
  FitProblem fixed = LoadProblem("chain_fine.json");
  const FitResult biased = RunFit(fixed);
  EXPECT_LT(biased.estimate(0), kMass - 100.0 * biased.uncertainty.standard_deviation(0));
}

}  // namespace
}  // namespace tangible
