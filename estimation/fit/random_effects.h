// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The spread of parameters that vary from recording to recording.
//
//   θ_b ~ N(μ, τ²)    or    ln θ_b ~ N(ln μ, τ²)          of each recording b
//
// At given τ the fit estimates μ and all θ_b, which are drawn towards μ (problem_with_priors.h).
// Minimising the cost over τ as well would end at τ = 0 with all θ_b equal. Instead τ is the mode
// of the restricted likelihood, the density of the observations with all parameters p = (μ, θ,
// others) integrated out, in the problem linearised at the estimate (Laplace's approximation):
//
//   ℓ(τ) = −Σ_e n_e ln τ_e − ½ ln det (Jᵀ J) − cost_min(τ)                                (1)
//
// n_e is the number of recordings, J the rows of observations, priors and effects; cost_min is the
// least cost over p of the linear problem. Fits and (1) alternate until τ no longer changes. Blocks
// are reduced to their triangular factors, and own parameters are eliminated block by block: one
// value of (1) costs the number of recordings times the cube of a recording's parameters.
//
// The interval of τ_e consists of the values that the contrasts of the θ_b do not reject, with the
// other spreads held:
//
//   Q(τ_e) = 2 (cost_min(τ_e) − cost_min(∞))  ~  χ² with n_e − 1 degrees of freedom         (2)
//
// which is exact for a linear model and noise of the size sigma (n_e where μ has a prior). Its
// lower end is 0 where the recordings do not differ more than their noise explains. An interval
// that ends above LargestSpread, and a spread that grows beyond it as fits and (1) alternate (where
// the value of a recording may be infinite, or 0 on a logarithmic scale), are not limited by the
// observations, and there is no interval.
//
// References: H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545 (restricted likelihood);
// N. Laird and J. Ware, Biometrics 38 (1982) 963; J. Pinheiro and D. Bates, Mixed-Effects Models in
// S and S-PLUS (2000), ch. 7 (alternating with the linearisation); W. Viechtbauer, Statistics in
// Medicine 26 (2007) 37, "Q-profile" (2).

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/problem/recordings.h"
#include "tangible/estimation/uncertainty/uncertainty.h"

namespace tangible {

/// The spread of one parameter.
struct SpreadEstimate {
  std::string name;  ///< of the parameter
  PriorKind kind = PriorKind::kGaussian;
  double spread = 0.0;  ///< τ, in the parameter's unit or of its logarithm; 0: none is seen
  ConfidenceInterval interval;  ///< 95 %; none where the spread was given, or not found or limited
  bool estimated = false;
  int recordings = 0;   ///< n_e
  bool limited = true;  ///< from above, by the observations
};

/// The problem linearised at an estimate, by which the spreads are estimated.
class SpreadLikelihood {
 public:
  /// `blocks`: for each block of the layout the factor of its observations and priors, without the
  /// rows of the effects, for changes of p itself (Reduce with dp/dq = 1). `free[k]`: parameter k
  /// is not at a bound.
  SpreadLikelihood(const BlockLayout& layout, std::vector<BlockFactor> blocks,
                   std::vector<RandomEffect> effects, Eigen::VectorXd estimate,
                   std::vector<bool> free);

  /// ℓ of (1) for these spreads, and 2 cost_min; each spread > 0.
  struct Value {
    double likelihood = 0.0;
    double twice_cost = 0.0;
  };
  Value At(const std::vector<double>& spreads) const;

  /// The smallest and largest spread of an effect that is considered: a thousandth of the deviation
  /// of a recording's own value, below which the likelihood is constant, and far above any
  /// estimate.
  std::pair<double, double> RangeOf(int effect) const;

 private:
  struct Normal {
    double log_determinant = 0.0;
    RowMatrixXd reduced;  ///< rows x [shared | r], own parameters eliminated
  };
  Normal Eliminate(int block, const std::vector<double>& spreads) const;

  BlockLayout layout_;
  std::vector<BlockFactor> blocks_;
  std::vector<RandomEffect> effects_;
  Eigen::VectorXd estimate_;
  std::vector<bool> free_;
};

/// Finds the spreads that maximise (1), starting from those of the effects of `problem`, with their
/// intervals. A given spread is not changed. A spread of 0 becomes the smallest of its range in
/// `problem`. `largest` is raised to the largest relative change of a spread above that. Returns
/// false, with a message, where a run at the estimate fails or the observations do not limit a
/// spread.
bool UpdateSpreads(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                   std::vector<SpreadEstimate>* spreads, double* largest, std::string* message);

}  // namespace tangible
