// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Controls: parameters of a model that have a separate value in each step, such as a motor's torque
// or a push.
//
//   parameter numbers[j] of the model = values(k, j)     during step k, [t_k, t_k+1)
//
// A derivative with respect to values(k, j) is that of step k with respect to the parameter.

#include <algorithm>
#include <optional>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/math/scalar.h"

namespace tangible {

template <typename T>
struct BasicControls {
  std::vector<int> numbers;  ///< places in Model::parameters
  /// A row for each step, a column for each number; steps after the last row use the last row.
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values;
};
using Controls = BasicControls<double>;

/// A model as it is in each step of a rollout.
template <typename T>
class ControlledModel {
 public:
  /// A model that is the same in all steps; it must outlive this object. What runs a model with
  /// controls runs one without.
  ControlledModel(const Model<T>& model)  // NOLINT(google-explicit-constructor): see above
      : model_(&model) {}
  ControlledModel(Model<T>&& model) = delete;
  ControlledModel(const Model<T>& model, const BasicControls<T>& controls)
      : model_(&model), controls_(&controls), own_(model) {}

  bool is_controlled() const { return controls_ != nullptr; }
  /// Null where the model has no controls.
  const BasicControls<T>* controls() const { return controls_; }
  const ModelStructure& structure() const { return *model_->structure; }
  /// The model in step k, until the next call.
  const Model<T>& At(long k) {
    if (controls_ == nullptr || controls_->values.rows() == 0) {
      return *model_;
    }
    const Eigen::Index row = std::clamp<Eigen::Index>(k, 0, controls_->values.rows() - 1);
    for (size_t j = 0; j < controls_->numbers.size(); ++j) {
      own_->parameters[controls_->numbers[j]] =
          controls_->values(row, static_cast<Eigen::Index>(j));
    }
    return *own_;
  }

 private:
  const Model<T>* model_;
  const BasicControls<T>* controls_ = nullptr;
  std::optional<Model<T>> own_;
};

}  // namespace tangible
