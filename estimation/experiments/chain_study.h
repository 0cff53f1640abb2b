// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well the masses of all links of the chain (data/scenes/chain.json) are found at once.
//
// Observations are what the scene predicts at its own masses m_k, with or without normal noise.
//
//   starts     without noise, from starts with each link log-uniform in [m / range, range m]:
//              reached if every mass is within `reached` of the truth, relative
//   coverage   with noise, from the truth: how many 95 % intervals contain the true mass

#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct ChainStudyOptions {
  int starts = 20;
  double range = 100.0;
  double reached = kReachedTruth;
  int replicas = 1000;
  double sigma = 0.001;  ///< m
  unsigned seed = 1;
  int max_iterations = 50;
};

struct ChainStart {
  FitStatus status = FitStatus::kFailed;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  double error = 0.0;  ///< the largest relative one of a mass
  double seconds = 0.0;
};

/// Intervals that contain the truth, of each link and of all.
struct ChainCoverage {
  int replicas = 0;
  int failed = 0;  ///< replicas without intervals: they count as not covered
  std::vector<int> covered, covered_robust;
  double Pooled(const std::vector<int>& counts) const;
};

class ChainStudy {
 public:
  /// `scene` has bodies named link*, all of which are observed `rate` times a second.
  ChainStudy(const Scene& scene, double rate, const ChainStudyOptions& options);

  int num_links() const { return static_cast<int>(truth_.size()); }

  /// One start; they are numbered, each with its own seed.
  ChainStart RunStart(int number) const;
  /// `progress` is called after each replica, with its number.
  ChainCoverage RunCoverage(const std::function<void(int)>& progress) const;

 private:
  FitProblem ProblemFrom(const std::vector<double>& initial) const;
  FitResult Run(const FitProblem& problem) const;

  ChainStudyOptions options_;
  FitProblem exact_;
  std::vector<double> truth_;
};

}  // namespace tangible
