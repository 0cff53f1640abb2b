// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A run beside another one: one number of its input is moved. Not for other users.

#include <optional>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

/// Moves what belongs to a column of the Jacobian of all inputs, for as long as it lives. All
/// numbers of a parameter move by the same, which keeps their differences.
class RolloutWorker::Beside {
 public:
  Beside(RolloutWorker* worker, Eigen::Index column, double shift);
  ~Beside();
  Beside(const Beside&) = delete;
  Beside& operator=(const Beside&) = delete;

  /// Whether a number may not be there; nothing may be run then.
  bool is_refused() const { return is_refused_; }

 private:
  void MoveParameter(const ParameterPath& parameter, double shift);

  RolloutWorker& worker_;
  State<double> initial_;
  // What is moved as it was.
  std::optional<Scene> scene_;
  Model<double> model_;
  State<double> scene_state_;
  std::optional<RowMatrixXd> controls_;
  bool is_refused_ = false;
};

}  // namespace tangible
