// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The sampling of a run: the states of bodies at the times of the observations.
//
// With fixed steps each component of a state, the angle included, is linear in time between the
// steps at t_k ≤ t ≤ t_{k+1},
//
//   q(t) = (1 − a) q_k + a q_{k+1},   a = (t − t_k) / (t_{k+1} − t_k)
//
// which is exact for the poses of semi-implicit Euler. With event stepping steps end at the
// observations' times (AddStepTimes), so that nothing is interpolated, in particular not across an
// event. A point moves with the interpolated pose: r = (x, y) + R(angle) at.
//
// The acceleration with fixed steps is that of the step that begins at t_k, (v_{k+1} − v_k) / h, at
// the run's end that of the last step, and linear between steps too. With event stepping it is the
// mean over twice kRateStep of a step around the time, for which steps end there; its error is of
// the square of that. A time nearer to an end of the run has the acceleration as near as that. An
// impact within that time is part of the mean.
//
// Where delays or clocks are parameters, the times move with them, and a sample has a rate: with
// fixed steps it is (q_{k+1} − q_k) / h of the interval, the derivative of the interpolation. At a
// step between two intervals, where the interpolation has a kink, it is the mean of both slopes, as
// central differences have it. With event stepping the rate of a pose is the twist at that time,
// that of a twist the mean acceleration as above, and that of an acceleration the second difference
// of these twists. Moving the ends of steps changes the motion only by the integrator's error, so
// that this derivative is right to the order of the step.

#include <algorithm>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/simulation/gradient/state_samples.h"

namespace tangible {

/// A body's state at one time; observations of its coordinates and points at that time share it.
struct Sample {
  int body = -1;
  double time = 0.0;  ///< s, of the run
  long step = 0;      ///< k
  double part = 0.0;  ///< a in [0, 1)
};

/// The quantities that are read at each sample.
struct SampleOptions {
  bool twists = false;         ///< velocities are observed, or accelerations
  bool accelerations = false;  ///< which come after the twists
  bool rates = false;  ///< the times of observations depend on parameters; 0 in a run of no steps
};

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
  /// Numbers of a sample: x, y, angle, with twists vx, vy, omega, with accelerations ax, ay, alpha.
  int width() const { return options_.accelerations ? 9 : options_.twists ? 6 : 3; }
  bool has_rates() const { return options_.rates; }
  /// The index of the sample of each observation's body; −1 for the time of an event.
  const std::vector<int>& sample_of() const { return sample_of_; }
  /// The sample of one of the places (measurement.h) of an observation; −1: it has none.
  int SampleOf(int observation, int place) const {
    return place == 0        ? sample_of_[observation]
           : others_.empty() ? -1
                             : others_[2 * static_cast<size_t>(observation) + place - 1];
  }
  /// The last step whose state a sample needs.
  long LastStepOf(int sample) const {
    return options_.accelerations ? last_step() : samples_[sample].step + 1;
  }
  /// The last step whose state is needed.
  long last_step() const { return std::max(numbers_.last_step(), rates_.last_step()); }
  /// The samples' numbers, width() rows each, as rows of the states of the run, and their rates.
  const StateSamples& numbers() const { return numbers_; }

  /// Adds the contribution of the state after k steps to the samples' numbers, and to their rates,
  /// width() numbers for each sample.
  void Add(long k, const State<double>& state, std::vector<double>* numbers,
           std::vector<double>* rates) const;

 private:
  int AddSample(int body, double time, const SimulationSettings& settings);
  template <typename Use>
  void UseState(const SimulationSettings& settings, int sample, long step, double weight,
                bool with_pose, const Use& use) const;
  template <typename Use>
  void UseAcceleration(const SimulationSettings& settings, int sample, long step, double weight,
                       const Use& use) const;
  template <typename Use>
  void ForEachShare(const SimulationSettings& settings, const Use& use) const;
  template <typename Use>
  void ForEachRate(const SimulationSettings& settings, const Use& use) const;
  template <typename Use>
  void ForEachEventAcceleration(const SimulationSettings& settings, int order,
                                const Use& use) const;

  SampleOptions options_;
  bool by_events_ = false;
  std::vector<Sample> samples_;
  std::vector<int> sample_of_;
  std::vector<int> others_;  ///< two for each observation; empty where no channel has any
  StateSamples numbers_;
  StateSamples rates_;
};

/// The times at which steps must end for these samples with event stepping.
std::vector<double> SplitTimes(const std::vector<double>& times, const SimulationSettings& settings,
                               const SampleOptions& options);

}  // namespace tangible
