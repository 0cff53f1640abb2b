// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Multiple shooting: a start for the fit where a single run is too long to be steered from its
// beginning.
//
// The run is cut at S − 1 steps. The states x_j of the moving bodies there are unknowns beside the
// parameters q; every segment runs from its own x_j, and its end must meet the next one:
//
//   minimise  1/2 Σ ρ(r_i(q, x)²) + 1/2 Σ_j ‖W (end_j(q, x_j) − x_{j+1})‖²
//
//   j = 0 .. S − 2,   x_0 = x_0(q)
//
// Over a short segment the predictions are nearly linear in the unknowns, so that a wrong period or
// a chaotic end does not trap the minimiser. W grows in stages, from jumps that cost little, when
// the observations alone place the states, to jumps of less than the noise. Joints and contacts of
// a segment's first step put right a state that violates them. The single run then starts at the
// parameters found: optimum and covariance are the fit's own, whatever S.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct ShootingResult {
  Eigen::VectorXd parameters;
  int iterations = 0;   ///< of all stages
  double jump = 0.0;    ///< the largest jump left, in multiples of the median sigma
  std::string message;  ///< why not all stages were done, or empty
};

/// Multiple shooting from `start`. Where a stage fails, the parameters of the one before are
/// returned.
ShootingResult Shoot(const FitOptions& options, const Eigen::VectorXd& start,
                     RolloutResiduals* residuals);

/// The residuals of multiple shooting: those of the observations, then the jumps; unknowns [q | x_1
/// | .. | x_{S−1}].
class ShootingResiduals {
 public:
  /// At most one segment a step.
  ShootingResiduals(int segments, RolloutResiduals* residuals);

  int num_segments() const { return static_cast<int>(cuts_.size()) - 1; }
  int state_size() const { return state_size_; }
  int num_unknowns() const { return num_parameters_ + (num_segments() - 1) * state_size_; }
  int num_observations() const;
  int num_residuals() const { return num_observations() + (num_segments() - 1) * state_size_; }

  /// The unknowns with the states of one whole run at q; false where that fails.
  bool Start(const Eigen::VectorXd& q, Eigen::VectorXd* unknowns);

  /// Standard deviation of jumps of positions and angles, in m and rad; of rates by the length of a
  /// segment.
  void SetJumpSigma(double sigma) { jump_sigma_ = sigma; }

  bool Evaluate(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals, RowMatrixXd* jacobian);

 private:
  struct Run;
  bool Compute(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals, RowMatrixXd* jacobian);
  bool RunSegment(int segment, Run* run);
  void AddShares(int segment, long k, Run* run) const;
  void Meet(int segment, Run* run) const;
  void Scatter(const Run& run) const;
  double JumpWeight(int i) const;

  RolloutResiduals* residuals_;
  std::vector<long> cuts_;  ///< steps 0 = cuts[0] < … < cuts[S] = last
  int num_parameters_ = 0;
  int state_size_ = 0;
  double segment_seconds_ = 0.0;
  double jump_sigma_ = 1.0;
};

}  // namespace tangible
