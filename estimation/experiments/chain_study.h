// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A study of how well the masses of all links of a chain (data/scenes/chain.json) are estimated at
// once.
//
// Observations are predictions of the scene at its own masses m_k, with or without normal noise.
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

/// One fit of observations with noise.
struct ChainReplica {
  bool converged = false;
  std::vector<int> covered, covered_robust;  ///< of each link: 1 if the interval contains the truth
};

/// The numbers of intervals that contain the truth, for each link and for all.
struct ChainCoverage {
  int replicas = 0;
  int failed = 0;  ///< replicas without intervals: they count as not covered
  std::vector<int> covered, covered_robust;
  double Pooled(const std::vector<int>& counts) const;
};

class ChainStudy {
 public:
  /// `scene` has bodies named link*, which are all observed `rate` times a second.
  ChainStudy(const Scene& scene, double rate, const ChainStudyOptions& options);

  int num_links() const { return static_cast<int>(truth_.size()); }

  /// Runs one of the numbered starts, each of which has its own seed.
  ChainStart RunStart(int number) const;
  /// Runs those of the numbered replicas that are wanted. All noise is one sequence, of which each
  /// replica has its own part, whichever others are run.
  std::vector<ChainReplica> RunReplicas(const std::function<bool(int)>& is_wanted) const;
  /// What replicas have in common.
  ChainCoverage CoverageOf(const std::vector<ChainReplica>& replicas) const;

 private:
  FitProblem ProblemFrom(const std::vector<double>& initial) const;
  FitResult Run(const FitProblem& problem) const;

  ChainStudyOptions options_;
  FitProblem exact_;
  std::vector<double> truth_;
};

}  // namespace tangible
