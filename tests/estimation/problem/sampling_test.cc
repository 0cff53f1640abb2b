// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tangible/estimation/problem/tolerances.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

Observation At(double time, int body) {
  Observation observation;
  observation.time = time;
  observation.body = body;
  return observation;
}

TEST(SamplingTest, TimesOnStepsReadOneStateAndOthersTwo) {
  SimulationSettings settings;
  settings.dt = 0.1;
  settings.duration = 0.25;  // the last step is half as long
  // 3 * 0.1 - 0.1 is not 0.2 in binary.
  const SamplePlan plan({At(0.0, 0), At(0.125, 0), At(3 * 0.1 - 0.1, 0), At(0.24, 0), At(0.25, 0)},
                        settings);
  ASSERT_EQ(plan.num_samples(), 5);
  EXPECT_EQ(plan.last_step(), 3);
  EXPECT_EQ(plan.samples()[0].step, 0);
  EXPECT_EQ(plan.samples()[0].part, 0.0);
  EXPECT_EQ(plan.samples()[1].step, 1);
  EXPECT_NEAR(plan.samples()[1].part, 0.25, 1e-12);
  EXPECT_EQ(plan.samples()[2].step, 2);
  EXPECT_EQ(plan.samples()[2].part, 0.0);
  EXPECT_EQ(plan.samples()[3].step, 2);
  EXPECT_NEAR(plan.samples()[3].part, 0.8, 1e-12);
  EXPECT_EQ(plan.samples()[4].step, 3);
  double sums[5] = {};
  for (long k = 0; k <= plan.last_step(); ++k) {
    for (const StateShare& share : plan.numbers().At(k)) {
      EXPECT_EQ(share.part, StatePart::kPose);
      sums[share.row / plan.width()] += share.weight;
    }
  }
  for (const double sum : sums) {
    EXPECT_DOUBLE_EQ(sum, 1.0);
  }
}

TEST(SamplingTest, CoordinatesOfOneBodyAtOneTimeShareASample) {
  Observation y = At(0.3, 1);
  y.coordinate = Coordinate::kY;
  const SamplePlan plan({At(0.3, 1), y, At(0.3, 0), At(0.3, 1)}, SimulationSettings());
  EXPECT_EQ(plan.num_samples(), 2);
  EXPECT_EQ(plan.sample_of(), (std::vector<int>{0, 0, 1, 0}));
}

// x(t) = sin t of one body and its twist cos t, as a run would hand them over.
double RateError(SimulationSettings settings, const SampleOptions& options, bool of_twist) {
  const std::vector<double> times = {0.0, 0.0337, 0.1, 0.123, 0.25};
  if (settings.stepping == Stepping::kEvent) {
    AddStepTimes(SplitTimes(times, settings, options), &settings);
  }
  std::vector<Observation> observations;
  for (const double time : times) {
    observations.push_back(At(time, 0));
  }
  const SamplePlan plan(observations, times, {Channel()}, {-1}, settings, options);
  std::vector<double> numbers(plan.width() * times.size(), 0.0);
  std::vector<double> rates(numbers.size(), 0.0);
  for (long k = 0; k <= plan.last_step(); ++k) {
    const double now = StepTime(settings, k);
    plan.Add(k, {{std::sin(now), 0.0, 0.0}, {std::cos(now), 0.0, 0.0}}, &numbers, &rates);
  }
  double worst = 0.0;
  for (size_t i = 0; i < times.size(); ++i) {
    const size_t first = i * static_cast<size_t>(plan.width());
    const double rate =
        of_twist ? rates[first + 3] + std::sin(times[i]) : rates[first] - std::cos(times[i]);
    worst = std::max(worst, std::abs(rate));
  }
  return worst;
}

TEST(SamplingTest, RatesAreHowASampleChangesWithItsTime) {
  SimulationSettings settings;
  settings.dt = 0.01;
  settings.duration = 0.25;
  // The slope of a chord: half a step times the second derivative.
  EXPECT_LT(RateError(settings, {.rates = true}, false), 0.5 * settings.dt);
  EXPECT_LT(RateError(settings, {.twists = true, .rates = true}, true), 0.5 * settings.dt * 1.01);
  settings.stepping = Stepping::kEvent;
  // The twist itself; its own rate to second order in kRateStep dt, at the ends to first.
  EXPECT_LT(RateError(settings, {.rates = true}, false), 1e-15);
  EXPECT_LT(RateError(settings, {.twists = true, .rates = true}, true),
            0.51 * kRateStep * settings.dt);
}

// With no step there is no second state: neither a step before the first is read, nor a difference
// over no time.
TEST(SamplingTest, ARunOfNoStepsHasStatesAndNoRates) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    for (const bool twists : {false, true}) {
      SimulationSettings settings;
      settings.duration = 0.0;
      settings.stepping = stepping;
      const SampleOptions options{.twists = twists, .accelerations = twists, .rates = true};
      AddStepTimes(SplitTimes({0.0}, settings, options), &settings);
      ASSERT_EQ(NumSteps(settings), 0);
      const SamplePlan plan({At(0.0, 0), At(0.0, 1)}, {0.0, 0.0}, {Channel()}, {-1}, settings,
                            options);
      EXPECT_EQ(plan.last_step(), 0);
      std::vector<double> numbers(2 * static_cast<size_t>(plan.width()), 0.0);
      std::vector<double> rates = numbers;
      plan.Add(0, {{1.0, 2.0, 3.0, 4.0, 5.0, 6.0}, {7.0, 8.0, 9.0, 0.0, 0.0, 0.0}}, &numbers,
               &rates);
      EXPECT_EQ(numbers[0], 1.0);
      EXPECT_EQ(numbers[static_cast<size_t>(plan.width())], 4.0);
      // Nothing accelerates where there is no second state.
      if (twists) {
        EXPECT_EQ(numbers[6], 0.0);
      }
      for (const double rate : rates) EXPECT_TRUE(std::isfinite(rate));
      // By events the rate of a place is the twist, which is known.
      EXPECT_EQ(rates[0], stepping == Stepping::kEvent ? 7.0 : 0.0);
    }
  }
}

TEST(SamplingTest, WhatAnObservationIsRelativeToIsSampledToo) {
  Channel relative;
  relative.to_body = 2;
  Channel seen;
  seen.camera = 0;
  std::vector<Observation> observations = {At(0.1, 0), At(0.1, 1), At(0.1, 2)};
  observations[0].channel = 1;
  observations[1].channel = 2;
  const SamplePlan plan(observations, {0.1, 0.1, 0.1}, {Channel(), relative, seen}, {-1, -1, 3},
                        SimulationSettings(), {});
  EXPECT_EQ(plan.num_samples(), 4);
  EXPECT_EQ(plan.samples()[plan.SampleOf(0, 1)].body, 2);
  EXPECT_EQ(plan.SampleOf(0, 2), -1);
  EXPECT_EQ(plan.samples()[plan.SampleOf(1, 2)].body, 3);
  EXPECT_EQ(plan.SampleOf(2, 0), plan.SampleOf(0, 1));
  EXPECT_EQ(plan.SampleOf(2, 1), -1);
}

}  // namespace
}  // namespace tangible
