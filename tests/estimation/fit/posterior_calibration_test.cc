// SPDX-License-Identifier: Apache-2.0
//
// Simulation-based calibration of the posterior: parameters drawn from their prior, observations
// made with them, and their ranks among draws from the posterior of these observations. The ranks
// are even if and only if fit, transformations, gradients and sampler belong to the same density.
//
// Reference: S. Talts, M. Betancourt, D. Simpson, A. Vehtari, A. Gelman, arXiv 1804.06788 (2018).
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <vector>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/posterior.h"
#include "tangible/estimation/uncertainty/nuts.h"

namespace tangible {
namespace {

constexpr int kBins = 10;
// Ranks from 0 to kRanks, 10 a bin, among every fourth draw, which are next to independent.
constexpr int kRanks = 99;
constexpr int kThinning = 4;
constexpr double kLeastProbability = 1e-3;

/// A draw from the prior of a parameter: Gaussian or log-normal, or even within its bounds.
double DrawFromPrior(const FitParameter& parameter, RandomStream* random) {
  if (!parameter.prior) {
    return *parameter.lower + random->Uniform() * (*parameter.upper - *parameter.lower);
  }
  const double deviation = parameter.prior->sigma * random->Normal();
  return parameter.prior->kind == PriorKind::kGaussian
             ? parameter.prior->center + deviation
             : parameter.prior->center * std::exp(deviation);
}

/// Observations with noise of a run with these parameters.
void Simulate(const Eigen::VectorXd& truth, RandomStream* random, FitProblem* problem) {
  for (Observation& observation : problem->observations) observation.value = 0.0;
  RolloutResiduals run =
      MakeResiduals(problem->scene, {}, problem->parameters, problem->observations);
  BlockEvaluation evaluation;
  ASSERT_TRUE(
      run.EvaluateBlock(0, truth, GradientMethod::kTangent, BlockDerivatives::kSkip, &evaluation))
      << evaluation.message;
  for (size_t i = 0; i < problem->observations.size(); ++i) {
    Observation& observation = problem->observations[i];
    observation.value =
        observation.sigma * (evaluation.residuals[static_cast<Eigen::Index>(i)] + random->Normal());
  }
}

/// The ranks of a replica's true parameters.
std::vector<int> RanksOf(const FitProblem& problem, const Eigen::VectorXd& truth, unsigned seed) {
  const FitInput input = InputOf(problem);
  ParameterError fault;
  int recording = 0;
  const std::unique_ptr<RecordingsProblem> recordings = MakeProblem(input, &fault, &recording);
  FitOptions options;
  options.approach = FitApproach::kPlain;
  options.starts = 0;
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.profile_pass = ProfilePass::kSkip;
  options.threads = 1;
  const FitResult fit = Fit(options, recordings.get(), {});
  PosteriorOptions sampling;
  sampling.draws = kRanks * kThinning;
  sampling.chains = 1;
  sampling.warm_up = 150;
  sampling.least_draws = 0;
  sampling.seed = seed;
  sampling.threads = 1;
  Posterior posterior;
  std::string error;
  EXPECT_TRUE(SamplePosterior(sampling, options, fit,
                              FreeCoordinates(recordings->entries(), recordings->effects()),
                              MakerOf(input, *recordings), {}, {}, &posterior, &error))
      << error;
  std::vector<int> ranks(static_cast<size_t>(truth.size()), 0);
  for (Eigen::Index i = kThinning - 1; i < posterior.draws.rows(); i += kThinning) {
    for (Eigen::Index k = 0; k < truth.size(); ++k) {
      ranks[static_cast<size_t>(k)] += posterior.draws(i, k) < truth[k] ? 1 : 0;
    }
  }
  return ranks;
}

void ExpectCalibrated(FitProblem problem) {
  const int replicas = NumReplicas();
  const size_t count = problem.parameters.size();
  std::vector<std::vector<int>> bins(count, std::vector<int>(kBins, 0));
  for (int replica = 0; replica < replicas; ++replica) {
    RandomStream random(2024, static_cast<unsigned>(replica));
    Eigen::VectorXd truth(static_cast<Eigen::Index>(count));
    for (size_t k = 0; k < count; ++k) {
      truth[static_cast<Eigen::Index>(k)] = DrawFromPrior(problem.parameters[k], &random);
    }
    ASSERT_NO_FATAL_FAILURE(Simulate(truth, &random, &problem));
    const std::vector<int> ranks = RanksOf(problem, truth, static_cast<unsigned>(replica));
    for (size_t k = 0; k < count; ++k) ++bins[k][ranks[k] * kBins / (kRanks + 1)];
  }
  const double expected = static_cast<double>(replicas) / kBins;
  for (size_t k = 0; k < count; ++k) {
    double square = 0.0;
    std::string text;
    for (const int bin : bins[k]) {
      square += (bin - expected) * (bin - expected) / expected;
      text += " " + std::to_string(bin);
    }
    const double probability =
        boost::math::cdf(boost::math::complement(boost::math::chi_squared(kBins - 1.0), square));
    std::cout << problem.parameters[k].name << ": p = " << probability << ", ranks" << text << "\n";
    EXPECT_GT(probability, kLeastProbability) << problem.parameters[k].name << ": ranks" << text;
  }
}

FitParameter Bounded(const std::string& path, double initial, double lower, double upper) {
  FitParameter parameter = Parameter(path, initial);
  parameter.lower = lower;
  parameter.upper = upper;
  return parameter;
}

FitParameter WithPrior(const std::string& path, const Prior& prior) {
  FitParameter parameter = Parameter(path, prior.center);
  parameter.prior = prior;
  return parameter;
}

/// Heights of the ball at `count` times up to the end.
std::vector<Observation> Heights(double end, int count, double sigma) {
  std::vector<Observation> observations;
  for (int i = 1; i <= count; ++i) {
    observations.push_back({end * i / count, 0, -1, Coordinate::kY, 0.0, sigma});
  }
  return observations;
}

// A ball that falls through air, seen so badly that the density is far from normal: damping within
// bounds, the speed with a Gaussian prior, the mass with a log-normal one.
TEST(PosteriorCalibrationTest, Flight) {
  FitProblem problem;
  problem.scene = MakeScene(R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 10],
     "velocity": [0, 3], "linear_damping": 0.3}],
    "simulation": {"dt": 0.25, "duration": 1}})");
  problem.parameters = {Bounded("bodies/ball/linear_damping", 1.0, 0.0, 4.0),
                        WithPrior("bodies/ball/velocity/y", {PriorKind::kGaussian, 3.0, 1.0}),
                        WithPrior("bodies/ball/mass", {PriorKind::kLogNormal, 1.0, 0.5})};
  problem.observations = Heights(1.0, 4, 0.2);
  ExpectCalibrated(problem);
}

// Through impacts, of which there is one or there are two: restitution within bounds.
TEST(PosteriorCalibrationTest, Impacts) {
  FitProblem problem;
  problem.scene = MakeScene(R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.1],
     "restitution": 0.5},
    {"name": "floor", "static": true, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.2, "duration": 1, "stepping": "event"}})");
  problem.parameters = {Bounded("bodies/*/restitution", 0.6, 0.2, 0.95),
                        WithPrior("bodies/ball/position/y", {PriorKind::kGaussian, 1.1, 0.1}),
                        WithPrior("bodies/ball/velocity/y", {PriorKind::kGaussian, 0.0, 0.3})};
  problem.observations = Heights(1.0, 5, 0.1);
  ExpectCalibrated(problem);
}

}  // namespace
}  // namespace tangible
