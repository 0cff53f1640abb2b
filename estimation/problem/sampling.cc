// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/sampling.h"

#include <algorithm>
#include <map>

#include "tangible/estimation/problem/tolerances.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

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
  if (part > 1.0 - kTimeTolerance) {
    sample->step = k + 1;
  } else if (part > kTimeTolerance) {
    sample->part = part;
  }
}

/// The times center − step, center, center + step between whose twists an acceleration is taken.
struct AccelerationTimes {
  double center, step;

  AccelerationTimes(double time, const SimulationSettings& settings)
      : step(std::min(kRateStep * settings.dt, 0.5 * settings.duration)) {
    center = std::clamp(time, step, std::max(step, settings.duration - step));
  }
};

}  // namespace

SamplePlan::SamplePlan(const std::vector<Observation>& observations,
                       const SimulationSettings& settings)
    : SamplePlan(observations,
                 [&] {
                   std::vector<double> times;
                   times.reserve(observations.size());
                   for (const Observation& observation : observations) {
                     times.push_back(observation.time);
                   }
                   return times;
                 }(),
                 {}, {}, settings, {}) {}

SamplePlan::SamplePlan(const std::vector<Observation>& observations,
                       const std::vector<double>& times, const std::vector<Channel>& channels,
                       const std::vector<int>& markers, const SimulationSettings& settings,
                       const SampleOptions& options)
    : options_(options), by_events_(settings.stepping == Stepping::kEvent) {
  std::map<std::pair<double, int>, int> known;  // by time and body
  const auto sample = [&](int body, double time) {
    // Most files are in the order of time.
    const int count = num_samples();
    const auto place = known.try_emplace(known.end(), {time, body}, count);
    return place->second == count ? AddSample(body, time, settings) : place->second;
  };
  const bool any_others =
      std::any_of(channels.begin(), channels.end(),
                  [](const Channel& c) { return c.to_body >= 0; }) ||
      std::any_of(markers.begin(), markers.end(), [](int marker) { return marker >= 0; });
  sample_of_.reserve(observations.size());
  for (size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].event >= 0 || IsForce(observations[i].coordinate)) {  // no sample is read
      sample_of_.push_back(-1);
      if (any_others) others_.insert(others_.end(), 2, -1);
      continue;
    }
    sample_of_.push_back(sample(observations[i].body, times[i]));
    if (any_others) {
      const int to = channels[observations[i].channel].to_body;
      const int marker = markers[observations[i].channel];
      others_.push_back(to < 0 ? -1 : sample(to, times[i]));
      others_.push_back(marker < 0 ? -1 : sample(marker, times[i]));
    }
  }
  samples_.shrink_to_fit();
  numbers_ = StateSamples([&](const auto& use) { ForEachShare(settings, use); });
  if (options_.rates) {
    rates_ = StateSamples([&](const auto& use) { ForEachRate(settings, use); });
  }
}

int SamplePlan::AddSample(int body, double time, const SimulationSettings& settings) {
  Sample sample{body, time};
  Locate(settings, &sample);
  samples_.push_back(sample);
  return num_samples() - 1;
}

/// Calls use(step, share) for a sample's numbers, with twists and accelerations as far as they are
/// read.
template <typename Use>
void SamplePlan::UseState(const SimulationSettings& settings, int sample, long step, double weight,
                          bool with_pose, const Use& use) const {
  const StateShare pose{width() * sample, samples_[sample].body, StatePart::kPose, weight};
  if (with_pose) use(step, pose);
  if (options_.twists) use(step, StateShare{pose.row + 3, pose.body, StatePart::kTwist, weight});
  if (options_.accelerations && !by_events_) UseAcceleration(settings, sample, step, weight, use);
}

/// The acceleration of the fixed step that begins at `step`, at the end of the last one.
template <typename Use>
void SamplePlan::UseAcceleration(const SimulationSettings& settings, int sample, long step,
                                 double weight, const Use& use) const {
  const long steps = NumSteps(settings);
  if (steps == 0) return;
  const long from = std::min(step, steps - 1);
  const double slope = weight / StepLength(settings, from);
  StateShare share{width() * sample + 6, samples_[sample].body, StatePart::kTwist, slope};
  use(from + 1, share);
  share.weight = -slope;
  use(from, share);
}

/// Of samples by events the mean acceleration (order 1), or its rate (order 2), from the twists at
/// three times.
template <typename Use>
void SamplePlan::ForEachEventAcceleration(const SimulationSettings& settings, int order,
                                          const Use& use) const {
  for (int i = 0; i < num_samples() && options_.accelerations; ++i) {
    const AccelerationTimes times(samples_[i].time, settings);
    const double h = times.step;
    if (!(h > 0.0)) continue;
    const double outer = order == 1 ? 0.5 / h : 1.0 / (h * h);
    const double weights[3] = {order == 1 ? -outer : outer, order == 1 ? 0.0 : -2.0 * outer, outer};
    for (int k = 0; k < 3; ++k) {
      if (weights[k] == 0.0) continue;
      Sample at = samples_[i];
      at.time = times.center + (k - 1) * h;
      Locate(settings, &at);
      // The end of a step that stands for several times may miss this one by rounding.
      use(at.part > 0.5 ? at.step + 1 : at.step,
          StateShare{width() * i + 6, at.body, StatePart::kTwist, weights[k]});
    }
  }
}

/// Calls use(step, share) for the states that the samples read.
template <typename Use>
void SamplePlan::ForEachShare(const SimulationSettings& settings, const Use& use) const {
  for (int i = 0; i < num_samples(); ++i) {
    const Sample& one = samples_[i];
    UseState(settings, i, one.step, 1.0 - one.part, true, use);
    if (one.part > 0.0) UseState(settings, i, one.step + 1, one.part, true, use);
  }
  if (by_events_) ForEachEventAcceleration(settings, 1, use);
}

/// Calls use(step, share) for what forms the rates: twists, and differences.
template <typename Use>
void SamplePlan::ForEachRate(const SimulationSettings& settings, const Use& use) const {
  if (by_events_) {
    ForEachShare(settings, [&](long step, StateShare share) {
      if (share.part == StatePart::kTwist) return;
      share.part = StatePart::kTwist;
      use(step, share);
    });
    if (!options_.twists) return;
    ForEachEventAcceleration(settings, 2, use);
  }
  const long steps = NumSteps(settings);
  if (steps == 0) {  // there is no second state, and nothing moves
    return;
  }
  const auto add = [&](int i, long from, long to, double weight) {
    const double slope = weight / (StepTime(settings, to) - StepTime(settings, from));
    UseState(settings, i, from, -slope, !by_events_, use);
    UseState(settings, i, to, slope, !by_events_, use);
  };
  for (int i = 0; i < num_samples(); ++i) {
    long from = std::min(samples_[i].step, steps - 1);
    long to = from + 1;
    if (!by_events_ && samples_[i].part == 0.0 && from > 0 && samples_[i].step == from) {
      add(i, from - 1, from, 0.5);
      add(i, from, to, 0.5);
      continue;
    }
    if (by_events_) {
      Sample around = samples_[i];
      around.time = std::max(0.0, samples_[i].time - kRateStep * settings.dt);
      Locate(settings, &around);
      from = around.step;
      around.time = std::min(settings.duration, samples_[i].time + kRateStep * settings.dt);
      Locate(settings, &around);
      to = around.step;
    }
    add(i, from, to, 1.0);
  }
}

void SamplePlan::Add(long k, const State<double>& state, std::vector<double>* numbers,
                     std::vector<double>* rates) const {
  numbers_.Add(k, state, numbers->data());
  rates_.Add(k, state, rates->data());
}

std::vector<double> SplitTimes(const std::vector<double>& times, const SimulationSettings& settings,
                               const SampleOptions& options) {
  std::vector<double> split = times;
  for (size_t i = 0; i < times.size() && options.accelerations; ++i) {
    const AccelerationTimes around(times[i], settings);
    for (const int k : {-1, 0, 1}) split.push_back(around.center + k * around.step);
  }
  if (options.rates && options.twists) {
    for (const double time : times) {
      split.push_back(time - kRateStep * settings.dt);
      split.push_back(time + kRateStep * settings.dt);
    }
  }
  return split;
}

}  // namespace tangible
