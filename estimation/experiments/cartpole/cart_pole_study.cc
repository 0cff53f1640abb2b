// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/cart_pole_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <mutex>
#include <numbers>

#include "tangible/estimation/experiments/cartpole/tolerances.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kTestSamples = 400;        // of the motion that is predicted
constexpr unsigned kTestSeed = 1000000;  // beyond those of recordings
constexpr int kMembers = 5;              // of the ensemble
constexpr int kRepetitions = 20;         // of timings

const CartPoleState kHanging(0.0, std::numbers::pi, 0.0, 0.0);

Eigen::Vector2d Tip(const CartPole& numbers, const VectorX<double>& x) {
  return {x[0] - numbers.length * std::sin(x[1]), numbers.length * std::cos(x[1])};
}

// The errors over all windows of the test motion.
std::vector<double> PredictionErrors(StepMap* model, const CartPole& truth,
                                     const CartPoleRecording& test) {
  std::vector<double> sums(std::size(kHorizons), 0.0);
  std::vector<int> counts(std::size(kHorizons), 0);
  const int longest = kHorizons[std::size(kHorizons) - 1];
  std::string error;
  for (int start = 0; start + longest < test.samples(); start += 5) {
    VectorX<double> x = test.truth[start], next;
    bool made = true;
    for (int k = 0, i = 0; k < longest; ++k) {
      made = made &&
             model->Step(k, x, VectorX<double>::Constant(1, test.forces[start + k]), &next, &error);
      x = next;
      if (k + 1 != kHorizons[i]) continue;
      sums[i] += made ? (Tip(truth, x) - Tip(truth, test.truth[start + k + 1])).squaredNorm()
                      : std::numeric_limits<double>::infinity();
      ++counts[i++];
    }
  }
  for (size_t i = 0; i < sums.size(); ++i) sums[i] = std::sqrt(sums[i] / counts[i]);
  return sums;
}

CartPoleCell Evaluate(StepMap* model, const CartPoleStudyOptions& options, CartPolePlant* plant,
                      const CartPoleRecording& test) {
  CartPoleCell cell;
  cell.errors = PredictionErrors(model, options.truth, test);
  const SwingUp run = RunSwingUp(model, plant, kHanging, options.swing_up);
  cell.reward = run.reward;
  cell.success = run.success;
  return cell;
}

CartPoleCell EvaluateEngine(const CartPoleRecording& recording, const CartPoleStudyOptions& options,
                            CartPolePlant* plant, const CartPoleRecording& test) {
  const CartPoleEstimate estimate = EstimateCartPole(recording);
  CartPoleCell cell;
  if (estimate.ok) {
    CartPoleStep step(estimate.numbers);
    cell = Evaluate(&step, options, plant, test);
    cell.estimates = NumbersOf(estimate.numbers);
  } else {
    cell.errors.assign(std::size(kHorizons), std::numeric_limits<double>::infinity());
    cell.estimates.assign(estimate.names.size(), NAN);
  }
  for (size_t i = 0; i < estimate.names.size(); ++i) {
    const ConfidenceInterval interval =
        estimate.ok ? estimate.fit.uncertainty.confidence_95[i] : std::nullopt;
    cell.low.push_back(interval ? interval->first : NAN);
    cell.high.push_back(interval ? interval->second : NAN);
  }
  return cell;
}

// Calls `work` for each number below `count` on several threads, and `progress` after each.
void ForEachTask(int threads, int count, const std::function<void(int)>& work,
                 const std::function<void(long, long)>& progress) {
  std::mutex mutex;
  long done = 0;
  ForEachOnThreads(threads, count, [&](int i) {
    work(i);
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done, count);
  });
}

unsigned SeedOf(const CartPoleStudyOptions& options, int number) {
  return options.seed + static_cast<unsigned>(number);
}

// The least CPU time of a call.
double LeastTime(const std::function<void()>& call) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepetitions; ++i) {
    const std::clock_t began = std::clock();
    call();
    least = std::min(least, static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
  }
  return least;
}

// The engine's step with Jacobians by central differences.
class DifferencedStep : public StepMap {
 public:
  explicit DifferencedStep(StepMap* map) : map_(map) {}
  int num_states() const override { return map_->num_states(); }
  int num_controls() const override { return map_->num_controls(); }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override {
    return map_->Step(k, x, u, next, error);
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    a->resize(num_states(), num_states());
    b->resize(num_states(), num_controls());
    const auto n = static_cast<Eigen::Index>(num_states());
    for (Eigen::Index i = 0; i < n + num_controls(); ++i) {
      VectorX<double> ends[2];
      for (const int end : {0, 1}) {
        VectorX<double> at = x, force = u;
        (i < n ? at[i] : force[i - n]) += end == 0 ? -kMapDifference : kMapDifference;
        if (!map_->Step(k, at, force, &ends[end], error)) return false;
      }
      (i < n ? a->col(i) : b->col(i - n)) = (ends[1] - ends[0]) / (2.0 * kMapDifference);
    }
    return map_->Step(k, x, u, next, error);
  }

 private:
  StepMap* map_;
};

}  // namespace

const char* NameOf(PlantKind kind) {
  return kind == PlantKind::kEquations ? "equations" : "mujoco";
}

std::unique_ptr<CartPolePlant> MakePlant(PlantKind kind, const CartPole& numbers) {
  return kind == PlantKind::kEquations ? MakeEquationPlant(numbers) : MakeMujocoPlant(numbers);
}

CartPoleCurves RunCurves(const CartPoleStudyOptions& options,
                         const std::function<void(long, long)>& progress) {
  const int counts = static_cast<int>(options.samples.size());
  CartPoleCurves curves(counts, std::vector<std::vector<CartPoleCell>>(options.seeds));
  const auto work = [&](int task) {
    // The longest tasks come first, so that all threads end at about the same time.
    const int count = counts - 1 - task / options.seeds, seed = task % options.seeds;
    const std::unique_ptr<CartPolePlant> plant = MakePlant(options.plant, options.truth);
    const CartPoleRecording recording =
        RecordRandomly(plant.get(), options.samples.back(), SeedOf(options, seed))
            .Head(options.samples[count]);
    const CartPoleRecording test =
        RecordRandomly(plant.get(), kTestSamples, kTestSeed + SeedOf(options, seed));
    std::vector<CartPoleCell>& cells = curves[count][seed];
    cells.push_back(EvaluateEngine(recording, options, plant.get(), test));
    int tried = 0;
    LearnedStepOptions tuned = TuneLearnedStep(recording, options.updates, &tried);
    for (const int members : {1, kMembers}) {
      tuned.members = members;
      LearnedStep step(recording, tuned);
      cells.push_back(Evaluate(&step, options, plant.get(), test));
      cells.back().tuned = tuned;
    }
  };
  ForEachTask(options.threads, counts * options.seeds, work, progress);
  return curves;
}

CartPoleCoverage RunCoverage(const CartPoleStudyOptions& options, int seeds, int samples,
                             const std::function<void(long, long)>& progress) {
  const std::vector<double> truth = NumbersOf(options.truth);
  std::vector<CartPoleEstimate> estimates(seeds);
  const auto work = [&](int i) {
    const std::unique_ptr<CartPolePlant> plant = MakePlant(options.plant, options.truth);
    estimates[i] = EstimateCartPole(RecordRandomly(plant.get(), samples, SeedOf(options, i)));
  };
  ForEachTask(options.threads, seeds, work, progress);
  CartPoleCoverage coverage;
  coverage.seeds = seeds;
  coverage.covered.assign(truth.size(), 0);
  coverage.largest_off.assign(truth.size(), 0.0);
  for (const CartPoleEstimate& estimate : estimates) {
    for (size_t i = 0; i < truth.size(); ++i) {
      const double off = estimate.ok ? std::abs(NumbersOf(estimate.numbers)[i] / truth[i] - 1.0)
                                     : std::numeric_limits<double>::infinity();
      coverage.largest_off[i] = std::max(coverage.largest_off[i], off);
      if (!estimate.ok) continue;
      const ConfidenceInterval& interval = estimate.fit.uncertainty.confidence_95[i];
      const bool covered = interval && interval->first <= truth[i] && truth[i] <= interval->second;
      coverage.covered[i] += covered ? 1 : 0;
    }
  }
  return coverage;
}

SwingUpTable RunSwingUps(const CartPoleStudyOptions& options, int starts, int samples,
                         const std::function<void(long, long)>& progress) {
  std::vector<std::array<SwingUp, 2>> runs(starts);
  const auto work = [&](int i) {
    const std::unique_ptr<CartPolePlant> plant = MakePlant(options.plant, options.truth);
    const CartPoleEstimate estimate =
        EstimateCartPole(RecordRandomly(plant.get(), samples, SeedOf(options, i)));
    const CartPoleState start = RandomStart(options.seed, static_cast<unsigned>(i));
    CartPoleStep truth(options.truth);
    runs[i][0] = RunSwingUp(&truth, plant.get(), start, options.swing_up);
    if (!estimate.ok) return;
    CartPoleStep learned(estimate.numbers);
    runs[i][1] = RunSwingUp(&learned, plant.get(), start, options.swing_up);
  };
  ForEachTask(options.threads, starts, work, progress);
  SwingUpTable table;
  table.starts = starts;
  for (const std::array<SwingUp, 2>& run : runs) {
    table.with_truth += run[0].success ? 1 : 0;
    table.with_learned += run[1].success ? 1 : 0;
    table.cpu_seconds.insert(table.cpu_seconds.end(), run[1].cpu_seconds.begin(),
                             run[1].cpu_seconds.end());
  }
  std::sort(table.cpu_seconds.begin(), table.cpu_seconds.end());
  return table;
}

PlanCost MeasurePlan(const CartPoleStudyOptions& options) {
  CartPoleStep step(options.truth);
  DifferencedStep differenced(&step);
  const VectorX<double> start = kHanging, force = VectorX<double>::Constant(1, 1.0);
  const Cost cost = SwingUpCost();
  const VectorX<double> bound = VectorX<double>::Constant(1, kCartPoleForce);
  const RowMatrixXd controls = RowMatrixXd::Constant(options.swing_up.horizon, 1, 1.0);
  std::string error;
  MatrixX<double> a, b;
  const auto roll = [&](bool linearise) {
    VectorX<double> x = start, next;
    for (int k = 0; k < options.swing_up.horizon; ++k) {
      linearise ? step.Linearise(k, x, force, &next, &a, &b, &error)
                : step.Step(k, x, force, &next, &error);
      x = next;
    }
  };
  const auto iterate = [&](StepMap* map) {
    IlqrOptions one;
    one.max_iterations = 1;
    SolveIlqr({map, &cost, start, -bound, bound, 0}, controls, one);
  };
  PlanCost measured;
  measured.rollout = LeastTime([&] { roll(false); });
  measured.linearised = LeastTime([&] { roll(true); });
  measured.iteration = LeastTime([&] { iterate(&step); });
  measured.differences = LeastTime([&] { iterate(&differenced); });
  return measured;
}

Quartiles QuartilesOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<size_t>(place);
    const size_t above = std::min(below + 1, values.size() - 1);
    const double part = place - static_cast<double>(below);
    // If both are infinite, their difference is not a number.
    return part == 0.0 ? values[below] : (1.0 - part) * values[below] + part * values[above];
  };
  return {at(0.25), at(0.5), at(0.75)};
}

}  // namespace tangible
