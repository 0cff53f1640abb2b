// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a parameter drifts over recordings in their order, as where a surface wears, a motor
// warms up or a camera was moved between them. A jackknife assumes that recordings can be
// exchanged: its interval then holds for the mean over these recordings, and not for later ones.
//
// Let recording t of n move the estimate by δ_t (equation (3) of robust_covariance.h). Their sums,
// less the part of the mean, wander farther where neighbours move it in the same direction:
//
//   S_t = Σ_{s ≤ t} (δ_s − δ̄),   L = Σ_t S_t² / (n Σ_t (δ_t − δ̄)²)
//
// Without a drift L has the distribution of ∫ B², with B a Brownian bridge (Cramér and von Mises).
//
// References: J. Nyblom, Journal of the American Statistical Association 84 (1989) 223 (L, against
// a random walk of the parameter); B. E. Hansen, Journal of Policy Modeling 14 (1992) 517 (L of
// single parameters); T. W. Anderson and D. A. Darling, Annals of Mathematical Statistics 23 (1952)
// 193, equation (4.35) (its distribution).

#include <Eigen/Core>

namespace tangible {

/// With fewer recordings nothing is said about a drift.
inline constexpr int kFewestOfDrift = 10;

/// The probability of so large an L, or a larger one, where what recordings add in their order
/// (`moved`) can be exchanged; NaN with fewer than kFewestOfDrift, or where all are equal.
double DriftProbability(const Eigen::VectorXd& moved);

/// P(∫ B² > x), x > 0.
double ProbabilityOfBridge(double x);

}  // namespace tangible
