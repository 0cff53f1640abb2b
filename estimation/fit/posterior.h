// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Draws from the posterior density of a fit's parameters, by the No-U-Turn sampler (nuts.h),
//
//   ln π(p) = −cost(p) − Σ_k ln p_k over k with a log-normal prior            (1)
//
// with the cost of the fit, priors, weights and robust loss included: a parameter without a prior
// has a constant density within its bounds. A log-normal prior is one of ln p, hence the last term.
// The spread of parameters that vary is taken as known. The sampler moves in x, which has no
// bounds; the density of x has the factor dp/dx:
//
//   both bounds     p = l + (u − l) / (1 + exp(−x))
//   one bound       p = l + exp(x)  or  u − exp(x)
//   none            p = x
//
// Its first mass matrix is the information matrix of the fit in x,
//
//   H = J_xᵀ W J_x + diag(max(0, ∂cost/∂p p″) − (ln p′)″)                     (2)
//
// near the estimate: one that is at a bound is moved inside, to where the density has fallen by
// about a factor e. Chains begin at draws from the normal density of twice its deviations.
//
// Each chain has a problem and a stream of random numbers of its own, so that the result has the
// same bits for any number of threads. The posterior trusts model and sigma.

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/fit_parts.h"
#include "tangible/estimation/uncertainty/chain_statistics.h"

namespace tangible {

/// Hotter replicas are next to those of a constant density.
inline constexpr int kMostTemperatures = 32;

struct PosteriorOptions {
  int draws = 1000;     ///< N, of all chains together
  int chains = 4;       ///< each makes ⌈max(N, least_draws) / chains⌉, of which N are kept
  int warm_up = 200;    ///< of each chain
  double target = 0.8;  ///< mean acceptance, in (0, 1)
  unsigned seed = 0;
  int threads = 0;  ///< 0: one a core. The result does not depend on it
  /// Draws that all chains together make at least: statistics of fewer would say little.
  int least_draws = 1000;
  int temperatures = 1;  ///< of each chain (nuts.h): more pass between modes, and take as much more
};

struct Posterior {
  PosteriorOptions options;
  Eigen::MatrixXd draws;      ///< N x parameters, at equal distances along each chain in turn
  Eigen::VectorXd costs;      ///< of these
  std::vector<int> chain_of;  ///< of these
  std::vector<ChainStatistics> parameters;  ///< of each, from all transitions after the warm-up
  int transitions = 0;                      ///< of all chains after the warm-up
  int divergences = 0;                      ///< of these
  int saturated = 0;                        ///< of these, at the largest number of steps
  std::vector<double> steps;                ///< of each chain
  double acceptance = 0.0;                  ///< mean
  double exchanged = 1.0;                   ///< the least of a chain (NutsChain)
  long evaluations = 0;                     ///< of the cost with its gradient
  double seconds = 0.0;
  std::vector<std::string> warnings;
};

/// A parameter in a coordinate x without bounds.
struct FreeCoordinate {
  double lower = 0.0, upper = 0.0;  ///< of p; infinite: none
  bool of_logarithm = false;        ///< the density is stated for ln p

  /// p and its derivatives by x, with the logarithm of the factor of the density and its.
  struct Value {
    double p, first, second;
    double log_factor, log_factor_first, log_factor_second;
  };
  Value At(double x) const;
  /// x of a p strictly within the bounds.
  double From(double p) const;
};

/// A problem for one chain, the same for all.
using ProblemMaker = std::function<std::shared_ptr<LeastSquaresProblem>()>;

/// The recordings of a fit, with its priors and spreads. `input` and `problem` must outlive it.
ProblemMaker MakerOf(const FitInput& input, const RecordingsProblem& problem);

/// Of the problem's entries.
std::vector<FreeCoordinate> FreeCoordinates(const std::vector<ParameterEntry>& entries,
                                            const std::vector<RandomEffect>& effects);

/// Samples around the estimate of `result`, which `fit` led to. `show`, which may be empty, gets
/// the number of transitions that are done, from one thread at a time. `done` has chains to take
/// over that others have made around the same estimate, or none. False with one line where there is
/// no density to be sampled.
bool SamplePosterior(const PosteriorOptions& options, const FitOptions& fit,
                     const FitResult& result, const std::vector<FreeCoordinate>& coordinates,
                     const ProblemMaker& maker, const std::function<void(long)>& show,
                     const std::map<int, FinishedChain>& done, Posterior* posterior,
                     std::string* error);

/// Some of the chains, by their numbers; likewise.
bool MakeChains(const PosteriorOptions& options, const FitOptions& fit, const FitResult& result,
                const std::vector<FreeCoordinate>& coordinates, const ProblemMaker& maker,
                const std::vector<int>& numbers, std::vector<FinishedChain>* chains,
                std::string* error);

/// The number of transitions of all chains, the warm-up's included.
long TransitionsOf(const PosteriorOptions& options);

/// Puts the intervals of a posterior in the place of the others, and its warnings to those of the
/// fit.
void TakeIntervals(const Posterior& posterior, FitResult* result);

}  // namespace tangible
