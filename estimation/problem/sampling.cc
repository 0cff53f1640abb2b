// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/sampling.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

// A time this near to a step, in steps, is that step's: decimal times miss it by rounding.
constexpr double kOnStep = 1e-9;

/// Sets step and part of a sample from its time.
void Locate(const SimulationSettings& settings, Sample* sample) {
  const long steps = NumSteps(settings);
  long k = std::clamp(static_cast<long>(sample->time / settings.dt), 0L, steps);
  if (!settings.step_times.empty()) {
    k = std::upper_bound(settings.step_times.begin(), settings.step_times.end(), sample->time) -
        settings.step_times.begin() - 1;
  }
  while (k > 0 && StepTime(settings, k) > sample->time) {
    --k;
  }
  while (k < steps && StepTime(settings, k + 1) <= sample->time) {
    ++k;
  }
  sample->step = k;
  sample->part = 0.0;
  if (k == steps) {
    return;
  }
  const double start = StepTime(settings, k);
  const double part = (sample->time - start) / (StepTime(settings, k + 1) - start);
  if (part > 1.0 - kOnStep) {
    sample->step = k + 1;
  } else if (part > kOnStep) {
    sample->part = part;
  }
}

}  // namespace

SamplePlan::SamplePlan(const std::vector<Observation>& observations,
                       const SimulationSettings& settings) {
  std::map<std::pair<double, int>, int> known;  // by time and body
  sample_of_.reserve(observations.size());
  for (const Observation& observation : observations) {
    // Most files are in the order of time.
    const int count = num_samples();
    const auto place = known.try_emplace(known.end(), {observation.time, observation.body}, count);
    if (place->second == count) {
      Sample sample{observation.body, observation.time};
      Locate(settings, &sample);
      samples_.push_back(sample);
    }
    sample_of_.push_back(place->second);
  }
  samples_.shrink_to_fit();
  long last = 0;
  for (const Sample& sample : samples_) {
    last = std::max(last, sample.step + (sample.part > 0.0 ? 1 : 0));
  }
  // First how many each step has, then where they begin.
  first_share_.assign(static_cast<size_t>(last) + 2, 0);
  const auto for_each = [this](const auto& use) {
    for (int i = 0; i < num_samples(); ++i) {
      const Sample& sample = samples_[i];
      use(sample.step, SampleShare{i, 1.0 - sample.part});
      if (sample.part > 0.0) {
        use(sample.step + 1, SampleShare{i, sample.part});
      }
    }
  };
  for_each([this](long step, const SampleShare&) { ++first_share_[step + 1]; });
  std::partial_sum(first_share_.begin(), first_share_.end(), first_share_.begin());
  shares_.resize(first_share_.back());
  std::vector<size_t> next(first_share_.begin(), first_share_.end() - 1);
  for_each([&](long step, const SampleShare& share) { shares_[next[step]++] = share; });
}

Prediction Predict(Coordinate coordinate, const double* pose, const Vector2<double>& at) {
  const double c = std::cos(pose[2]);
  const double s = std::sin(pose[2]);
  Prediction prediction;
  switch (coordinate) {
    case Coordinate::kX:
      prediction.value = pose[0] + c * at.x() - s * at.y();
      prediction.by_pose[0] = 1.0;
      prediction.by_pose[2] = -s * at.x() - c * at.y();
      prediction.by_at[0] = c;
      prediction.by_at[1] = -s;
      break;
    case Coordinate::kY:
      prediction.value = pose[1] + s * at.x() + c * at.y();
      prediction.by_pose[1] = 1.0;
      prediction.by_pose[2] = c * at.x() - s * at.y();
      prediction.by_at[0] = s;
      prediction.by_at[1] = c;
      break;
    case Coordinate::kAngle:
      prediction.value = pose[2];
      prediction.by_pose[2] = 1.0;
      break;
  }
  return prediction;
}

}  // namespace tangible
