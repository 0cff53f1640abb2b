// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/disc_rollout.h"

#include <numeric>
#include <stdexcept>

namespace tangible {

RolloutFunction RolloutOf(const DiscWorld& world, int frames) {
  std::vector<long> records(static_cast<size_t>(frames) + 1);
  std::iota(records.begin(), records.end(), 0);
  RolloutFunction function;
  const std::string error = function.Create(SceneOf(world, frames), {}, {}, records);
  if (!error.empty()) throw std::logic_error("discs: " + error);
  return function;
}

VectorX<double> EngineState(const double* states, int discs) {
  VectorX<double> state = VectorX<double>::Zero(6 * static_cast<Eigen::Index>(discs));
  for (int i = 0; i < discs; ++i) {
    state[6 * i] = states[4 * i];
    state[6 * i + 1] = states[4 * i + 1];
    state[6 * i + 3] = states[4 * i + 2];
    state[6 * i + 4] = states[4 * i + 3];
  }
  return state;
}

}  // namespace tangible
