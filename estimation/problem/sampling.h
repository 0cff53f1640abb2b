// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where a run is read: the states of bodies at the times of the observations.
//
// With fixed steps each component of a state, the angle included, is linear in time between the
// steps at t_k ≤ t ≤ t_{k+1},
//
//   q(t) = (1 − a) q_k + a q_{k+1},   a = (t − t_k) / (t_{k+1} − t_k)
//
// which is exact for the poses of semi-implicit Euler. With event stepping steps end at the
// observations' times (AddStepTimes), so that nothing is interpolated, and never across an event. A
// point is moved with the pose so found: r = (x, y) + R(angle) at.
//
// Where delays or clocks are parameters, the times move with them, and the rate of a sample says
// how it changes: (q_{k+1} − q_k) / h of the interval with fixed steps, which is the derivative of
// what is sampled (at a step: that of the interval after it). By events a pose changes with the
// twist at that time, and a twist with the mean acceleration over twice kRateStep of a step around
// it, for which steps end there too. Steps that end elsewhere integrate alike but for the
// integrator's error, so that this derivative holds to the order of the step.

#include <span>
#include <utility>
#include <vector>

#include "tangible/dynamics/model/state.h"
#include "tangible/estimation/problem/observation.h"

namespace tangible {

/// A body's state at one time; observations of its coordinates and points at that time share it.
struct Sample {
  int body = -1;
  double time = 0.0;  ///< s, of the run
  long step = 0;      ///< k
  double part = 0.0;  ///< a in [0, 1)
};

/// A state's share in a sample.
struct SampleShare {
  int sample = -1;
  double weight = 0.0;
};

/// What is read of each sample.
struct SampleOptions {
  bool twists = false;  ///< velocities are observed
  bool rates = false;   ///< the times of observations depend on parameters
};

/// Of a step with event stepping: half the time over which an acceleration is averaged.
inline constexpr double kRateStep = 1e-3;

class SamplePlan {
 public:
  SamplePlan() = default;
  /// Observations of single bodies at their recorded times.
  SamplePlan(const std::vector<Observation>& observations, const SimulationSettings& settings);
  /// `times` in the run; `markers`: the body of each channel's camera's marker, or −1.
  SamplePlan(const std::vector<Observation>& observations, const std::vector<double>& times,
             const std::vector<Channel>& channels, const std::vector<int>& markers,
             const SimulationSettings& settings, const SampleOptions& options);

  const std::vector<Sample>& samples() const { return samples_; }
  int num_samples() const { return static_cast<int>(samples_.size()); }
  /// Numbers of a sample: x, y, angle, and with twists vx, vy, omega.
  int width() const { return options_.twists ? 6 : 3; }
  bool has_rates() const { return options_.rates; }
  /// The sample of the body of each observation.
  const std::vector<int>& sample_of() const { return sample_of_; }
  /// The sample of one of the places (measurement.h) of an observation; −1: it has none.
  int SampleOf(int observation, int place) const {
    return place == 0        ? sample_of_[observation]
           : others_.empty() ? -1
                             : others_[2 * static_cast<size_t>(observation) + place - 1];
  }
  /// The last step whose state is needed.
  long last_step() const { return static_cast<long>(shares_.first.size()) - 2; }
  /// What the state after k steps contributes to.
  std::span<const SampleShare> SharesAt(long k) const { return shares_.At(k); }

  /// Adds the share of the state after k steps to the samples' numbers, and to their rates, width()
  /// a sample each.
  void Add(long k, const State<double>& state, std::vector<double>* numbers,
           std::vector<double>* rates) const;

 private:
  /// Shares by step.
  struct Shares {
    std::vector<size_t> first = {0, 0};  ///< of each step, and the end of the last one's
    std::vector<SampleShare> all;

    std::span<const SampleShare> At(long k) const {
      return {all.data() + first[k], first[k + 1] - first[k]};
    }
    template <typename ForEach>
    void Fill(long last, const ForEach& for_each);
  };
  int AddSample(int body, double time, const SimulationSettings& settings);
  template <typename Use>
  void ForEachRate(const SimulationSettings& settings, const Use& use) const;
  void AddRate(const SampleShare& share, const State<double>& state,
               std::vector<double>* rates) const;

  SampleOptions options_;
  bool by_events_ = false;
  std::vector<Sample> samples_;
  std::vector<int> sample_of_;
  std::vector<int> others_;  ///< two an observation; empty where no channel has any
  Shares shares_;
  Shares rate_shares_;
};

/// The times at which steps must end for these samples with event stepping.
std::vector<double> SplitTimes(const std::vector<double>& times, const SimulationSettings& settings,
                               const SampleOptions& options);

}  // namespace tangible
