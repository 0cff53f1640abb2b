// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The smoothing of a run with random forces: a least-squares problem whose rows are linked in time
// alone, solved by orthogonal transformations from its end to its start.
//
// Between two knots the m forces F are constant. They follow from innovations ε, which are
// independent and of variance 1, by way of u, which are the forces in units of their size:
//
//   u_k = a_k u_{k−1} + c_k ε_k,   F_k = s_k u_k                                             (1)
//
// A white force of intensity q has a = 0, c = 1 and s = q / √Δ in an interval of length Δ. With the
// correlation time τ and the standard deviation s it has a = exp(−Δ/τ), where Δ is the distance of
// the intervals, and c = √(1 − a²); the first has a = 0 and c = 1. Where an interval, which is no
// shorter than a step, is longer than τ, F is the mean of the process over it: with l = Δ/τ its
// variance is s² 2 (l − 1 + e⁻ˡ) / l², and a is the correlation of two means that follow each
// other, (1 − e⁻ˡ)² / (2 (l − 1 + e⁻ˡ)) at equal distances. To first order at a run
//
//   dx_{k+1} = X_k dx_k + G_k dF_k + P_k dp,    dx_0 = S dp                        (2)
//   cost = 1/2 Σ_k (‖ε_k‖² + ‖W_k (r_k + H_k [dp; dx_k; dF_k])‖²)                  (3)
//
// with the weights W of a robust loss. From the last interval on, the rows of an interval and those
// of the cost behind it, ‖T_{k+1} [dx; du; dp; 1]_{k+1}‖, are transformed into
//
//   ‖E_k dε_k + K_k [dx; du; dp; 1]_k‖² + ‖T_k [dx; du; dp; 1]_k‖²      E_k triangular       (4)
//
// of which dε_k makes the first 0. E_k is never singular, because ε_k has rows of its own; nothing
// is squared, and nothing is assumed of X_k, which joints make singular. What is left at the start
// is the cost over dp. With dp = 0 the least cost is lower by 1/2 Σ ‖K_k's last column‖². The
// density of the observations with all forces integrated out has the logarithm
//
//   −(least cost) − Σ_k ln |det E_k| + constant                                              (5)
//
// exactly where the model is linear, and by Laplace's approximation elsewhere.
//
// References: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation (1977), ch.
// X; B. M. Bell, SIAM J. Optimization 4 (1994) 626, the iterated Kalman smoother as Gauss-Newton.

#include <Eigen/Core>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// One interval between knots; n numbers of the state, m forces, P parameters.
struct NoiseInterval {
  RowMatrixXd map;                     ///< [P_k | X_k | G_k], n x (P + n + m)
  RowMatrixXd rows;                    ///< H_k, observations within the interval x (P + n + m)
  Eigen::VectorXd residuals;           ///< r_k
  Eigen::VectorXd weights;             ///< W_k: roots of the weights
  std::vector<int> observations;       ///< of each row, which it is
  Eigen::VectorXd force;               ///< F_k at which this is linear
  Eigen::VectorXd decay, drive, size;  ///< a, c and s of (1)
  Eigen::VectorXd innovation;          ///< ε_k of these forces
};

struct NoiseSweep {
  /// [E_k | K_k], m x (m + n + m + P + 1), of each interval.
  std::vector<RowMatrixXd> gains;
  RowMatrixXd border;            ///< T over [dp; 1] at the start, at most P rows
  double remainder = 0.0;        ///< ≥ 0: 2 cost = ‖border [dp; 1]‖² + remainder
  double log_determinant = 0.0;  ///< Σ ln |det E_k|
  double decrement = 0.0;        ///< the root of Σ ‖K_k's last column‖²
};

/// (4). `start` is S, n x P. Of equal bits whatever ran before.
NoiseSweep SweepNoise(const std::vector<NoiseInterval>& intervals, const RowMatrixXd& start);

/// dε_k at given changes [dx; du; dp; t] of the state before the interval; t = 1 goes to the least
/// cost, 0 only follows the changes.
Eigen::VectorXd NoiseStep(const RowMatrixXd& gains, const Eigen::VectorXd& changes);

/// How the least cost's forces change with the parameters: of each observation the derivative of
/// its residual (rows x P), and of each ε_k (m rows an interval).
void NoiseSensitivity(const std::vector<NoiseInterval>& intervals, const NoiseSweep& sweep,
                      const RowMatrixXd& start, RowMatrixXd* observations,
                      RowMatrixXd* innovations);

/// Means and variances given the observations.
struct NoiseMoments {
  RowMatrixXd force;            ///< intervals x m
  RowMatrixXd force_deviation;  ///< the same
  RowMatrixXd state_change;     ///< knots (one more than intervals) x n: dx
  RowMatrixXd state_deviation;  ///< the same
  Eigen::VectorXd squares;      ///< of each force Σ_k E[ε_k²]
};

/// The moments with parameters at dp of the covariance `p_covariance` (P x P).
NoiseMoments MomentsOfNoise(const std::vector<NoiseInterval>& intervals, const NoiseSweep& sweep,
                            const RowMatrixXd& start, const Eigen::VectorXd& dp,
                            const RowMatrixXd& p_covariance);

}  // namespace tangible
