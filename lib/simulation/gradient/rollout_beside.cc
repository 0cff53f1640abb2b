// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/rollout_beside.h"

#include <utility>

#include "tangible/dynamics/model/state_variable.h"
#include "tangible/scene/validate.h"

namespace tangible {

RolloutWorker::Beside::Beside(RolloutWorker* worker, Eigen::Index column, double shift)
    : worker_(*worker), initial_(worker->initial_) {
  const RolloutFunction& f = worker_.f_;
  const Eigen::Index state = column - f.num_parameters();
  const Eigen::Index control = state - f.num_states();
  if (state < 0) {
    MoveParameter(f.parameters_[static_cast<size_t>(column)], shift);
  } else if (control < 0) {
    StateNumber(&worker_.initial_, f.outputs_[static_cast<size_t>(state)]) += shift;
  } else {
    controls_ = worker_.controls_.values;
    for (size_t j = 0; j < f.control_of_number_.size(); ++j) {
      if (f.control_of_number_[j] == control % f.num_controls()) {
        worker_.controls_.values(control / f.num_controls(), static_cast<Eigen::Index>(j)) += shift;
      }
    }
  }
}

void RolloutWorker::Beside::MoveParameter(const ParameterPath& parameter, double shift) {
  scene_ = worker_.scene_;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&worker_.scene_);
  for (const int i : parameter.numbers) {
    *numbers[i].value += shift;
    is_refused_ = is_refused_ || !IsAllowed(numbers[i].kind, *numbers[i].value);
  }
  // A scene that was built in memory, and is not allowed where it is, is no reason.
  const auto is_valid = [](const Scene& scene) { return Validate(scene, "").empty(); };
  is_refused_ = is_refused_ || (!is_valid(worker_.scene_) && is_valid(*scene_));
  if (is_refused_) return;
  model_ = worker_.model_;
  scene_state_ = worker_.scene_state_;
  BuildModelWithStructure(worker_.scene_, worker_.f_.structure_, &worker_.model_,
                          &worker_.scene_state_);
  worker_.initial_ = worker_.scene_state_;
  if (worker_.own_state_) {
    worker_.f_.SetState(worker_.f_.StateOf(initial_), &worker_.initial_);
  }
}

RolloutWorker::Beside::~Beside() {
  worker_.initial_ = std::move(initial_);
  if (controls_) worker_.controls_.values = std::move(*controls_);
  if (scene_) worker_.scene_ = std::move(*scene_);
  if (scene_ && !is_refused_) {
    worker_.model_ = std::move(model_);
    worker_.scene_state_ = std::move(scene_state_);
  }
}

}  // namespace tangible
