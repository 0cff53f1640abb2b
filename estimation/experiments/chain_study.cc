// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/chain_study.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

RolloutResiduals ResidualsOf(const FitProblem& problem) {
  ParameterizedScene scene;
  ParameterError error;
  scene.Create(problem.scene, problem.points, problem.parameters, &error);
  return RolloutResiduals(scene, problem.observations);
}

}  // namespace

double ChainCoverage::Pooled(const std::vector<int>& counts) const {
  double sum = 0.0;
  for (const int count : counts) {
    sum += count;
  }
  return sum / (static_cast<double>(replicas) * static_cast<double>(counts.size()));
}

ChainStudy::ChainStudy(const Scene& scene, double rate, const ChainStudyOptions& options)
    : options_(options) {
  exact_.scene = scene;
  exact_.options.max_iterations = options.max_iterations;
  exact_.options.certificate = CertificatePass::kSkip;
  exact_.options.held_test = HeldTest::kSkip;
  exact_.options.profile_pass = ProfilePass::kSkip;
  for (size_t body = 0; body < scene.bodies.size(); ++body) {
    const BasicBody<double>& link = scene.bodies[body];
    if (link.motion == Motion::kMoving && link.name.rfind("link", 0) == 0) {
      FitParameter mass;
      mass.name = link.name + " mass";
      mass.lower = link.mass / (100.0 * options.range);
      mass.upper = link.mass * 100.0 * options.range;
      mass.sets = {{"bodies/" + link.name + "/mass"}};
      exact_.parameters.push_back(mass);
      truth_.push_back(link.mass);
    }
    const int samples =
        static_cast<int>(std::floor(scene.simulation.duration * rate + kSampleRounding));
    for (int k = 0; k <= samples && link.motion == Motion::kMoving; ++k) {
      for (const Coordinate coordinate : {Coordinate::kX, Coordinate::kY}) {
        exact_.observations.push_back(
            {k / rate, static_cast<int>(body), -1, coordinate, 0.0, options.sigma});
      }
    }
  }
  // The predictions at the truth are the residuals of observations that are 0.
  RolloutResiduals residuals = ResidualsOf(exact_);
  Eigen::VectorXd predicted;
  residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &predicted, nullptr);
  for (size_t i = 0; i < exact_.observations.size(); ++i) {
    exact_.observations[i].value = options.sigma * predicted[static_cast<Eigen::Index>(i)];
  }
}

FitProblem ChainStudy::ProblemFrom(const std::vector<double>& initial) const {
  FitProblem problem = exact_;
  for (size_t k = 0; k < initial.size(); ++k) {
    problem.parameters[k].initial = initial[k];
  }
  return problem;
}

FitResult ChainStudy::Run(const FitProblem& problem) const {
  RolloutResiduals residuals = ResidualsOf(problem);
  return Fit(problem.options, &residuals, {});
}

ChainStart ChainStudy::RunStart(int number) const {
  std::seed_seq seed{static_cast<unsigned>(number), options_.seed};
  std::mt19937_64 random(seed);
  std::vector<double> initial;
  for (const double mass : truth_) {
    initial.push_back(mass * std::pow(options_.range, 2.0 * Uniform(&random) - 1.0));
  }
  const FitResult result = Run(ProblemFrom(initial));
  ChainStart start;
  start.status = result.status;
  start.initial_cost = result.initial_cost;
  start.final_cost = result.final_cost;
  start.seconds = result.seconds;
  start.error = result.estimate.size() > 0 ? 0.0 : HUGE_VAL;
  for (Eigen::Index k = 0; k < result.estimate.size(); ++k) {
    start.error = std::max(start.error, std::abs(result.estimate[k] / truth_[k] - 1.0));
  }
  return start;
}

std::vector<ChainReplica> ChainStudy::RunReplicas(const std::function<bool(int)>& is_wanted) const {
  std::vector<ChainReplica> replicas;
  std::mt19937_64 random(options_.seed);
  for (int number = 0; number < options_.replicas; ++number) {
    if (!is_wanted(number)) {
      for (size_t i = 0; i < exact_.observations.size(); ++i) Normal(&random);
      continue;
    }
    FitProblem problem = ProblemFrom(truth_);
    for (Observation& observation : problem.observations) {
      observation.value += options_.sigma * Normal(&random);
    }
    const FitResult result = Run(problem);
    ChainReplica& replica = replicas.emplace_back();
    replica.converged = result.status == FitStatus::kConverged;
    replica.covered.assign(truth_.size(), 0);
    replica.covered_robust.assign(truth_.size(), 0);
    for (size_t k = 0; k < truth_.size() && result.estimate.size() > 0; ++k) {
      const auto contains = [&](const ConfidenceInterval& interval) {
        return interval && interval->first <= truth_[k] && truth_[k] <= interval->second;
      };
      replica.covered[k] = contains(result.uncertainty.confidence_95[k]) ? 1 : 0;
      replica.covered_robust[k] = contains(result.uncertainty.confidence_95_robust[k]) ? 1 : 0;
    }
  }
  return replicas;
}

ChainCoverage ChainStudy::CoverageOf(const std::vector<ChainReplica>& replicas) const {
  ChainCoverage coverage;
  coverage.replicas = static_cast<int>(replicas.size());
  coverage.covered.assign(truth_.size(), 0);
  coverage.covered_robust.assign(truth_.size(), 0);
  for (const ChainReplica& replica : replicas) {
    coverage.failed += replica.converged ? 0 : 1;
    for (size_t k = 0; k < truth_.size(); ++k) {
      coverage.covered[k] += replica.covered[k];
      coverage.covered_robust[k] += replica.covered_robust[k];
    }
  }
  return coverage;
}

}  // namespace tangible
