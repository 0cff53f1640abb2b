// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How many samples it takes to learn and to swing up a cart and pole, with the engine and with
// perceptrons.
//
//   curves    for several seeds and numbers of samples of random motion: prediction errors 1 to 100
//             steps ahead, and the reward of swing-ups planned with what was learned
//   coverage  over many seeds: which of the 95 % intervals contain the true parameters
//   swing-ups from many random starts, with the true and with learned parameters

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/experiments/cartpole/cart_pole_control.h"
#include "tangible/estimation/experiments/cartpole/learned_step.h"

namespace tangible {

enum class PlantKind { kEquations, kMujoco };

/// "equations", "mujoco".
const char* NameOf(PlantKind kind);

/// Null where MuJoCo was not found at build.
std::unique_ptr<CartPolePlant> MakePlant(PlantKind kind, const CartPole& numbers);

struct CartPoleStudyOptions {
  PlantKind plant = PlantKind::kEquations;
  CartPole truth;
  std::vector<int> samples = {25, 50, 100, 200, 400, 800};  ///< ascending, >= 20
  int seeds = 10;
  unsigned seed = 1;   ///< the first
  int updates = 2000;  ///< of Adam
  SwingUpOptions swing_up{.steps = 300, .horizon = 50, .iterations = 1};
  int threads = 2;
};

inline constexpr const char* kCartPoleModels[] = {"engine", "perceptron", "ensemble"};
inline constexpr int kNumCartPoleModels = 3;
inline constexpr int kHorizons[] = {1, 2, 5, 10, 20, 50, 100};  ///< steps

/// The results of one model that was learned from the first samples of one recording.
struct CartPoleCell {
  std::vector<double> errors;  ///< by horizon: rms distance of the pole's tip from the truth, m
  double reward = 0.0;         ///< of a swing-up from rest
  bool success = false;
  LearnedStepOptions tuned;       ///< of the perceptrons
  std::vector<double> estimates;  ///< of the engine: the five numbers, with 95 % intervals
  std::vector<double> low, high;  ///< NaN where there is none
};

/// cells[samples][seed][model].
using CartPoleCurves = std::vector<std::vector<std::vector<CartPoleCell>>>;

/// `progress` is called with the number of recordings that are done and with that of all, by one
/// thread at a time.
CartPoleCurves RunCurves(const CartPoleStudyOptions& options,
                         const std::function<void(long, long)>& progress);

struct CartPoleCoverage {
  int seeds = 0;
  std::vector<int> covered;         ///< of each number
  std::vector<double> largest_off;  ///< of each number, relative
};
/// The coverage with the given number of samples.
CartPoleCoverage RunCoverage(const CartPoleStudyOptions& options, int seeds, int samples,
                             const std::function<void(long, long)>& progress);

struct SwingUpTable {
  int starts = 0, with_truth = 0, with_learned = 0;
  std::vector<double> cpu_seconds;  ///< of all plans with learned numbers, ascending
};
/// Each start has its own recording with the given number of samples.
SwingUpTable RunSwingUps(const CartPoleStudyOptions& options, int starts, int samples,
                         const std::function<void(long, long)>& progress);

/// CPU time of the parts of a plan, s; the least of several repetitions.
struct PlanCost {
  double rollout = 0.0;      ///< of a horizon's steps
  double linearised = 0.0;   ///< the same with the steps' Jacobians
  double iteration = 0.0;    ///< of iLQR
  double differences = 0.0;  ///< the Jacobians by central differences in their place
};
PlanCost MeasurePlan(const CartPoleStudyOptions& options);

/// The lower quartile, the median and the upper quartile.
struct Quartiles {
  double low = 0.0, median = 0.0, high = 0.0;
};
Quartiles QuartilesOf(std::vector<double> values);

}  // namespace tangible
