// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Several recordings in one fit: a block for each, with shared parameters and with parameters that
// each recording has separately, such as the initial positions and speeds of bodies.
//
//   p = [p_s | p_0 | p_1 | ... ],   r_b = r_b(p_s, p_b)
//
// A recording has a scene, observations and parameters of the same names in the same order as the
// others.

#include <string>
#include <vector>

#include "tangible/estimation/problem/residual.h"

namespace tangible {

struct RecordedRun {
  std::string name;
  double weight = 1.0;  ///< > 0
  RolloutResiduals residuals;
};

class RecordingsProblem : public LeastSquaresProblem {
 public:
  /// `own[i]`: whether each recording has a separate value of parameter i.
  RecordingsProblem(std::vector<RecordedRun> recordings, std::vector<bool> own);

  const std::vector<RecordedRun>& recordings() const { return recordings_; }
  /// Parameter i of a recording as an index in p.
  int ParameterOf(int recording, int i) const;
  /// The recording's own parameters, in its order, out of p.
  Eigen::VectorXd ParametersOf(int recording, const Eigen::VectorXd& p) const;

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return static_cast<int>(shared_.size()); }
  int num_blocks() const override { return static_cast<int>(recordings_.size()); }
  int num_own(int /*block*/) const override { return static_cast<int>(own_.size()); }
  int num_rows(int block) const override { return recordings_[block].residuals.num_residuals(); }
  double weight(int block) const override { return recordings_[block].weight; }
  std::vector<RowPlace> Places(int block) const override;
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, DerivativeMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override;
  std::optional<Certificate> Certify(const Eigen::VectorXd& p) override;
  HeldColumns EvaluateHeld(int block, const Eigen::VectorXd& p, DerivativeMethod method,
                           int most) override;
  std::vector<std::string> FindInconsistencies(const Eigen::VectorXd& p) override;
  std::unique_ptr<LeastSquaresProblem> Window(double part) const override;
  std::string BlockName(int block) const override {
    return "recording '" + recordings_[block].name + "': ";
  }

 private:
  /// Out of [shared | own], in the recording's order.
  Eigen::VectorXd Ordered(const Eigen::VectorXd& local) const;

  std::vector<RecordedRun> recordings_;
  std::vector<int> shared_, own_;  ///< indices in a recording's parameters
  std::vector<int> order_;         ///< indices of [shared | own] in a recording's parameters
  std::vector<ParameterEntry> entries_;
};

}  // namespace tangible
