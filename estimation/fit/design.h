// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The design of the next experiment: how much further takes with another start, other forces,
// another duration or another camera would narrow the intervals of a fit. To first order at the
// estimate, with the sigma of the observations,
//
//   F = Σ_b w_b S̃_bᵀ S̃_b + priors      information of the fit about the parameters that stay
//   F_c = S̃_cᵀ S̃_c                      and of one take of candidate c, with exact Jacobians
//   C_n = (F + n F_c)⁻¹                 after n takes;  width_k = 2 · 1.959964 sqrt(C_n,kk)
//
// S̃ are the columns of the parameters that stay after those that each take has anew, its nuisance,
// are eliminated: parameters that recordings have for themselves, and those that set nothing but
// poses and twists at the start, which a candidate may set, and does not know better than the fit
// did. A take observes what the first recording does, with the same sigma, at its times, which go
// on at their mean distance where a take is longer. Candidates are compared by
//
//   D   ln det(M (F + F_c) M)           the volume of the joint ellipsoid, to be large
//   A   tr(M⁻¹ C_1 M⁻¹)                 the sum of relative variances, to be small
//
// with M the typical magnitudes of the parameters. The gain ½ ln det(F + F_c) / det F is the
// expected information of a take, in nats (Pukelsheim, "Optimal Design of Experiments", 1993;
// Chaloner, Verdinelli, "Bayesian experimental design", 1995). All trust the model and sigma, and
// hold where the derivatives do. Parameters at a bound are held there.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct DesignCandidate {
  std::vector<std::pair<std::string, double>> values;  ///< of paths of the scene, in SI units
  std::optional<double> duration;                      ///< s, > 0; none: that of the recording
  int camera = -1;  ///< that all see it by, an index into the instruments; −1: as recorded
};

/// A 95 % interval that is to be at most so wide.
struct WantedWidth {
  int parameter = -1;  ///< index in p
  double width = 0.0;  ///< > 0
};

struct DesignRequest {
  std::vector<DesignCandidate> candidates;
  std::vector<WantedWidth> wanted;
};

/// Why a candidate cannot be made of an input, one line; empty: it can.
std::string CheckCandidate(const FitInput& input, const DesignCandidate& candidate);

/// Whether a parameter stays from take to take, so that further takes tell of it.
bool StaysOverTakes(const FitInput& input, const RecordingsProblem& problem, int parameter);

struct CandidateWorth {
  std::string message;  ///< why its run fails, or empty
  long observations = 0;
  Eigen::VectorXd widths;          ///< of Design::parameters with one take; NaN: not determined
  double log_determinant = NAN;    ///< D; −inf: not all are determined
  double relative_variance = NAN;  ///< A; infinite: the same
  double gain = NAN;               ///< nats; NaN where the fit does not determine all
  /// Of each wanted width the takes that it needs: 0: the fit has it already; none: more than
  /// kMostTakes, or no number of takes.
  std::vector<std::optional<long>> takes;
};
inline constexpr long kMostTakes = 1000000;

struct Design {
  std::vector<int> parameters;  ///< indices in p of those that stay and are at no bound
  Eigen::VectorXd widths;       ///< of these after the fit; NaN: not determined
  std::vector<WantedWidth> wanted;
  std::vector<CandidateWorth> candidates;
  int best_d = -1, best_a = -1;  ///< candidates; −1: none determines all
  std::vector<int> narrowest;  ///< of each of `parameters` the candidate; −1: none determines it
};

/// Compares the candidates of a request that has been checked. `problem` is that of the input, with
/// the spreads that were found, and `estimate` has all its parameters. Empty, or why there is no
/// design, one line.
std::string MakeDesign(const FitInput& input, const DesignRequest& request,
                       const Eigen::VectorXd& estimate, RecordingsProblem* problem, Design* design);

}  // namespace tangible
