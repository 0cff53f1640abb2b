// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/sampling.h"

#include <algorithm>
#include <map>
#include <numeric>

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

}  // namespace

template <typename ForEach>
void SamplePlan::Shares::Fill(long last, const ForEach& for_each) {
  // `first` is first the number of each step, then the index of its first entry.
  first.assign(static_cast<size_t>(last) + 2, 0);
  for_each([this](long step, const SampleShare&) { ++first[step + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  all.resize(first.back());
  std::vector<size_t> next(first.begin(), first.end() - 1);
  for_each([&](long step, const SampleShare& share) { all[next[step]++] = share; });
}

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
    sample_of_.push_back(sample(observations[i].body, times[i]));
    if (any_others) {
      const int to = channels[observations[i].channel].to_body;
      const int marker = markers[observations[i].channel];
      others_.push_back(to < 0 ? -1 : sample(to, times[i]));
      others_.push_back(marker < 0 ? -1 : sample(marker, times[i]));
    }
  }
  samples_.shrink_to_fit();
  const auto for_each_share = [this](const auto& use) {
    for (int i = 0; i < num_samples(); ++i) {
      const Sample& one = samples_[i];
      use(one.step, SampleShare{i, 1.0 - one.part});
      if (one.part > 0.0) {
        use(one.step + 1, SampleShare{i, one.part});
      }
    }
  };
  const auto for_each_rate = [&](const auto& use) { ForEachRate(settings, use); };
  long last = 0;
  const auto reach = [&last](long step, const SampleShare&) { last = std::max(last, step); };
  for_each_share(reach);
  for_each_rate(reach);
  shares_.Fill(last, for_each_share);
  rate_shares_.Fill(last, for_each_rate);
}

int SamplePlan::AddSample(int body, double time, const SimulationSettings& settings) {
  Sample sample{body, time};
  Locate(settings, &sample);
  samples_.push_back(sample);
  return num_samples() - 1;
}

/// Calls use(step, share) for the differences that form the rates.
template <typename Use>
void SamplePlan::ForEachRate(const SimulationSettings& settings, const Use& use) const {
  if (!options_.rates || (by_events_ && !options_.twists)) {
    return;
  }
  const long steps = NumSteps(settings);
  if (steps == 0) {  // there is no second state, and nothing moves
    return;
  }
  for (int i = 0; i < num_samples(); ++i) {
    long from = std::min(samples_[i].step, steps - 1);
    long to = from + 1;
    if (by_events_) {
      Sample around = samples_[i];
      around.time = std::max(0.0, samples_[i].time - kRateStep * settings.dt);
      Locate(settings, &around);
      from = around.step;
      around.time = std::min(settings.duration, samples_[i].time + kRateStep * settings.dt);
      Locate(settings, &around);
      to = around.step;
    }
    const double span = StepTime(settings, to) - StepTime(settings, from);
    use(from, SampleShare{i, -1.0 / span});
    use(to, SampleShare{i, 1.0 / span});
  }
}

void SamplePlan::Add(long k, const State<double>& state, std::vector<double>* numbers,
                     std::vector<double>* rates) const {
  for (const SampleShare& share : shares_.At(k)) {
    const size_t body = 3 * static_cast<size_t>(samples_[share.sample].body);
    const size_t first = static_cast<size_t>(width()) * static_cast<size_t>(share.sample);
    for (size_t i = 0; i < 3; ++i) {
      (*numbers)[first + i] += share.weight * state.pose[body + i];
    }
    for (size_t i = 0; i < 3 && options_.twists; ++i) {
      (*numbers)[first + 3 + i] += share.weight * state.twist[body + i];
    }
    for (size_t i = 0; i < 3 && options_.rates && by_events_; ++i) {
      (*rates)[first + i] += share.weight * state.twist[body + i];
    }
  }
  if (!options_.rates) {
    return;
  }
  for (const SampleShare& share : rate_shares_.At(k)) {
    AddRate(share, state, rates);
  }
}

void SamplePlan::AddRate(const SampleShare& share, const State<double>& state,
                         std::vector<double>* rates) const {
  const size_t body = 3 * static_cast<size_t>(samples_[share.sample].body);
  const size_t first = static_cast<size_t>(width()) * static_cast<size_t>(share.sample);
  for (size_t i = 0; i < 3 && !by_events_; ++i) {
    (*rates)[first + i] += share.weight * state.pose[body + i];
  }
  for (size_t i = 0; i < 3 && options_.twists; ++i) {
    (*rates)[first + 3 + i] += share.weight * state.twist[body + i];
  }
}

std::vector<double> SplitTimes(const std::vector<double>& times, const SimulationSettings& settings,
                               const SampleOptions& options) {
  std::vector<double> split = times;
  if (options.rates && options.twists) {
    for (const double time : times) {
      split.push_back(time - kRateStep * settings.dt);
      split.push_back(time + kRateStep * settings.dt);
    }
  }
  return split;
}

}  // namespace tangible
