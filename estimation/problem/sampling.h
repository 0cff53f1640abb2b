// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where a run is read: the poses at the times of the observations, and the coordinates they
// predict.
//
// Between the steps at t_k ≤ t ≤ t_{k+1} each component of a pose, the angle included, is linear in
// time,
//
//   q(t) = (1 − a) q_k + a q_{k+1},   a = (t − t_k) / (t_{k+1} − t_k)
//
// which is exact for the map of semi-implicit Euler. With event stepping steps end at the
// observations' times (AddStepTimes), so that nothing is interpolated, and never across an event. A
// point is moved with the pose so found:
// r = (x, y) + R(angle) at.

#include <span>
#include <utility>
#include <vector>

#include "tangible/estimation/problem/observation.h"

namespace tangible {

/// A body's pose at one time; observations of its x, y, angle and points at that time share it.
struct Sample {
  int body = -1;
  double time = 0.0;
  long step = 0;      ///< k
  double part = 0.0;  ///< a in [0, 1)
};

/// A state's share in a sample.
struct SampleShare {
  int sample = -1;
  double weight = 0.0;
};

class SamplePlan {
 public:
  SamplePlan() = default;
  SamplePlan(const std::vector<Observation>& observations, const SimulationSettings& settings);

  const std::vector<Sample>& samples() const { return samples_; }
  int num_samples() const { return static_cast<int>(samples_.size()); }
  /// The sample of each observation.
  const std::vector<int>& sample_of() const { return sample_of_; }
  /// The last step whose state is needed.
  long last_step() const { return static_cast<long>(first_share_.size()) - 2; }
  /// What the state after k steps contributes to.
  std::span<const SampleShare> SharesAt(long k) const {
    return {shares_.data() + first_share_[k], first_share_[k + 1] - first_share_[k]};
  }

 private:
  std::vector<Sample> samples_;
  std::vector<int> sample_of_;
  std::vector<size_t> first_share_ = {0, 0};  ///< of each step, and the end of the last one's
  std::vector<SampleShare> shares_;           ///< by step
};

/// A predicted coordinate with its derivatives.
struct Prediction {
  double value = 0.0;
  double by_pose[3] = {0.0, 0.0, 0.0};  ///< x, y, angle
  double by_at[2] = {0.0, 0.0};         ///< place of the point in the body
};

/// The coordinate of the point `at` of a body with this pose (x, y, angle).
Prediction Predict(Coordinate coordinate, const double* pose, const Vector2<double>& at);

}  // namespace tangible
