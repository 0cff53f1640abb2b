// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Multiple shooting: a start for the fit where a single run depends too strongly on its initial
// state.
//
// Each run is cut at S − 1 steps. The states x_j of the moving bodies at the cuts are further
// unknowns beside the parameters p, own parameters of the recording. Every segment runs from its
// own x_j, and its end must agree with the next state:
//
//   minimise  1/2 Σ ρ(r_i(p, x)²) + 1/2 Σ_j ‖W (end_j(p, x_j) − x_{j+1})‖²
//
//   j = 0 .. S − 2,   x_0 = x_0(p)
//
// Over a short segment the predictions are nearly linear in the unknowns, so that a wrong period or
// a chaotic end does not trap the minimiser. The states begin at those that the observations around
// them give (observed_state.h), on the joints, where rows of the joints' errors and rates keep
// them; components that are not observed begin at those of the run at the initial values. W grows
// in stages: at first jumps cost little and the observations determine the states, at the end jumps
// are smaller than the noise. The fit of the whole run then starts at the parameters found, so that
// its optimum and covariance do not depend on S.

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/problem/recordings.h"

namespace tangible {

/// The most segments into which a run can be cut: each needs a step, observations at two times on
/// average, and the states at the cuts are not so many that a factorisation takes longer than runs;
/// 1 where what is observed needs the whole run.
int MostSegments(const RolloutResiduals& residuals);

/// The residuals of one run in segments: those of the observations, then the jumps, then the errors
/// of the joints of each state and their rates, six a joint; unknowns [p | x_1 | .. | x_{S−1}].
class ShootingResiduals {
 public:
  /// `segments`, or as many as MostSegments.
  ShootingResiduals(int segments, RolloutResiduals* residuals);

  int num_segments() const { return static_cast<int>(cuts_.size()) - 1; }
  int state_size() const { return state_size_; }
  int num_states() const { return (num_segments() - 1) * state_size_; }
  int num_unknowns() const { return num_parameters_ + num_states(); }
  int num_observations() const;
  int num_residuals() const {
    return num_observations() + num_states() + (num_segments() - 1) * num_joint_rows();
  }

  /// The states x_1 ... x_{S−1} of one whole run at p; returns false where that fails.
  bool StatesOfRun(const Eigen::VectorXd& p, Eigen::VectorXd* states);
  /// The same, with the components that the observations around each cut determine taken from
  /// these.
  void StatesFromObservations(const Eigen::VectorXd& p, Eigen::VectorXd* states);

  /// Sets the standard deviation of jumps of positions and angles, in m and rad; that of jumps of
  /// rates follows from the length of a segment.
  void SetJumpSigma(double sigma) { jump_sigma_ = sigma; }
  /// The same for the errors of the joints.
  void SetJointSigma(double sigma) { joint_sigma_ = sigma; }

  /// At [p | states]; `jacobian` may be null.
  bool Evaluate(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals, RowMatrixXd* jacobian);

 private:
  struct Run;
  bool RunSegment(int segment, Run* run);
  void AddShares(int segment, long k, const State<double>& state, Run* run) const;
  void Meet(int segment, Run* run) const;
  int num_joint_rows() const;
  void AddJoints(int segment, Run* run) const;
  void AddJointShare(const JointIndex& joint, int k, int segment, int row, Run* run) const;
  void Scatter(const Run& run) const;
  double JumpWeight(int i) const;

  RolloutResiduals* residuals_;
  std::vector<long> cuts_;  ///< steps 0 = cuts[0] < … < cuts[S] = last
  int num_parameters_ = 0;
  std::vector<int> variables_;  ///< of the states of moving bodies
  int state_size_ = 0;
  double segment_seconds_ = 0.0;
  double jump_sigma_ = 1.0;
  double joint_sigma_ = 1.0;
};

/// All runs in segments: the states are further own parameters of each recording, the jumps further
/// rows of its block, without the robust loss.
class ShootingProblem : public LeastSquaresProblem {
 public:
  /// `problem` must outlive this object.
  ShootingProblem(int segments, RecordingsProblem* problem);

  /// [p | states] from p; returns false where no run can be cut.
  bool Start(const Eigen::VectorXd& p, Eigen::VectorXd* unknowns);
  /// The parameters p of [p | states].
  Eigen::VectorXd ParametersOf(const Eigen::VectorXd& unknowns) const;
  /// Sets the standard deviation of jumps in multiples of the median sigma of each recording.
  void SetJumpSigma(double sigma);
  /// The parameters that vary, with their indices in [p | states].
  const std::vector<RandomEffect>& effects() const { return effects_; }

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return problem_->num_shared(); }
  int num_blocks() const override { return problem_->num_blocks(); }
  int num_own(int block) const override {
    return problem_->num_own(block) + runs_[block].num_states();
  }
  int num_rows(int block) const override { return runs_[block].num_residuals(); }
  int num_observation_rows(int block) const override { return problem_->num_rows(block); }
  double weight(int block) const override { return problem_->weight(block); }
  std::vector<RowPlace> Places(int block) const override { return problem_->Places(block); }
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override;
  std::string BlockName(int block) const override { return problem_->BlockName(block); }

 private:
  RecordingsProblem* problem_;
  std::vector<ShootingResiduals> runs_;
  std::vector<double> median_sigma_;
  std::vector<ParameterEntry> entries_;
  std::vector<RandomEffect> effects_;
};

/// Multiple shooting from `start`. The result has the parameters of the stage with the least cost
/// of the whole runs. If a stage fails, the stages before it count, with a message. Evaluations of
/// stages go through `log` unless it is null.
FitApproachResult Shoot(const FitOptions& options, const Eigen::VectorXd& start,
                        RecordingsProblem* problem, EvaluationLog* log);

}  // namespace tangible
