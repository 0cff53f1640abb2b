// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The covariance of estimates whose residuals are not consistent with sigma: too large, of unequal
// size, or correlated in time or within a recording, because the model is incomplete.
//
// Let recording g have residuals r_i (i in g), rows S_i = ∂r_i/∂(shared parameters) and O_i =
// ∂r_i/∂(its own ones), and weights ψ(r) = r, or Huber's b sign(r) beyond b. Own parameters are
// eliminated first, by O_g⁺ over the rows that count (|r| <= b):
//
//   D_g = O_g⁺ S_g,   S̃_g = S_g − O_g D_g,   A_g = S̃_gᵀ S̃_g,   A = Σ A_g + A_prior      (1)
//   u_i = A⁻¹ S̃_iᵀ ψ(r_i)                 what residual i adds to the shared estimates      (2)
//
// With at least kFewRecordings recordings these are the clusters. Leaving out g moves the estimate
// by δ_g to first order; the jackknife (CR3) is
//
//   δ_g = (A − A_g)⁻¹ Σ_{i in g} S̃_iᵀ ψ(r_i)
//   V = (G − 1)/G Σ_g δ_g δ_gᵀ + A⁻¹ A_prior A⁻¹      (3)
//   ν_k = max(1, G*_k − 1),   G*_k = (Σ_g w_g)² / Σ_g w_g²,   w_g = (A⁻¹ A_g A⁻¹)_kk
//
// G*, the effective number of clusters, is G where all carry the same information about parameter
// k. With fewer recordings V is the sum over them of a covariance that allows for autocorrelation:
// with u_t the sum of u_i over all residuals at the same time, and Bartlett's kernel of time
// differences,
//
//   V_g = f Σ_{t, t'} k_tt' u_t u_t'ᵀ,   k_tt' = max(0, 1 − |t − t'| / S)      (4)
//   f = N / (N − P) / (1 − β + β²/3),    β = S / duration of the recording
//   ν_k = (Σ_t w_t)² / Σ_tt' k_tt'² w_t w_t',    w_t = Σ_{i at t} (A⁻¹ S̃_iᵀ)_k²
//
// A residual whose row decides a parameter alone, as the only sample behind a force, is 0 however
// large its error: those at a time t have the variance I − H_t. For what they do not show, which is
// little where many residuals share in a parameter,
//
//   V_g += s² Σ_t Z_tᵀ Z_t,   Z_t = H_t S̃_t A⁻¹,   H_t = S̃_t A⁻¹ S̃_tᵀ + O_t (O_gᵀ O_g)⁺ O_tᵀ    (5)
//
// is added, with s² = Σ ψ² / (N − P), of N − P degrees of freedom, or with Huber's loss what the
// median of the residuals says, if that is more.
//
// S follows Andrews: a first-order autoregression (ρ_k, σ_k) of each u_k gives the width 1.1447 (α
// T)^(1/3) samples, α = Σ_k 4 ρ_k² / ((1 − ρ_k)⁶ (1 + ρ_k)²) / Σ_k 1 / (1 − ρ_k)⁴ with u_k scaled
// to σ_k = 1. β is at most a third. f compensates for the reduction of the variance of residuals by
// the fit. ν_k is Satterthwaite's number of degrees of freedom for residuals that are white. A
// prior is a measurement of known deviation: it adds A⁻¹ A_prior A⁻¹, whose degrees of freedom are
// infinite. An interval is ± the 0.975 quantile of Student's t with ν_k degrees of freedom.
//
// Own parameters of a recording have (4) and (5) of O_g⁺ ψ alone, and D_g V D_gᵀ of the shared
// ones.
//
// References: D. W. K. Andrews, Econometrica 59 (1991) 817, eqs. (5.1), (6.2), (6.4); W. K. Newey
// and K. D. West, Econometrica 55 (1987) 703; N. M. Kiefer and T. J. Vogelsang, Econometric Theory
// 21 (2005) 1130 (f); R. M. Bell and D. F. McCaffrey, Survey Methodology 28 (2002) 169 (the
// jackknife and degrees of freedom of clusters); A. V. Carter, K. T. Schnepel and D. G.
// Steigerwald, Review of Economics and Statistics 99 (2017) 698 (G*); F. E. Satterthwaite,
// Biometrics Bulletin 2 (1946) 110.

#include <Eigen/Core>
#include <vector>

#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {

/// From this number of recordings on, the recordings are the clusters.
inline constexpr int kFewRecordings = 5;

/// The residuals of one recording at the estimate, over the parameters that are free.
struct RecordingRows {
  std::vector<double> times;  ///< s, of each row
  Eigen::VectorXd residuals;  ///< in multiples of sigma
  double weight = 1.0;        ///< of the recording; the matrices have its root already
  RowMatrixXd shared;         ///< rows x shared parameters
  RowMatrixXd own;            ///< rows x parameters of this recording alone; maybe none
  /// Priors on own parameters, which may involve shared ones; may be empty.
  Eigen::VectorXd prior_residuals;
  RowMatrixXd prior_shared;  ///< priors x shared parameters
  RowMatrixXd prior_own;     ///< priors x own parameters
};

struct RobustOptions {
  double huber = 0.0;  ///< as FitOptions
  double rank_tolerance = kJacobianRank;
};

enum class RobustMethod {
  kNone,        ///< fewer residuals than parameters
  kRecordings,  ///< (3)
  kTime,        ///< (4) and (5)
};

/// "none", "recordings", "time".
const char* NameOf(RobustMethod method);

struct RobustCovariance {
  RobustMethod method = RobustMethod::kNone;
  RowMatrixXd shared;              ///< V; directions that are not determined have no part in it
  Eigen::VectorXd shared_freedom;  ///< ν
  /// Of each shared parameter, by what leaving out each recording moves (drift.h); empty unless
  /// recordings are the clusters.
  Eigen::VectorXd drift_p_value;
  std::vector<RowMatrixXd> own;  ///< of each recording
  std::vector<Eigen::VectorXd> own_freedom;
  double bandwidth = 0.0;  ///< S, s, the largest of a recording; 0: no autocorrelation counts
};

/// `prior` has the rows of priors on shared parameters (any number x shared parameters). The cost
/// is linear in the number of rows except for sorting them by time.
RobustCovariance EstimateRobustCovariance(const std::vector<RecordingRows>& recordings,
                                          const RowMatrixXd& prior, const RobustOptions& options);

/// The 0.975 quantile of Student's t; `freedom` > 0 need not be a whole number.
double StudentQuantile(double freedom);

}  // namespace tangible
