// SPDX-License-Identifier: Apache-2.0
//
// tangible-cartpole: a cart and pole is learned from random motion and swung up, the engine's model
// beside perceptrons.

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/estimation/experiments/cartpole/cart_pole_study.h"
#include "tangible/render/plot.h"
#include "tangible/render/recorder/view_recorder.h"
#include "tangible/scene/json_writer.h"

DEFINE_string(samples, "25,50,100,200,400,800",
              "numbers of samples, at 50 Hz, that models learn from");
DEFINE_int32(seeds, 10, "recordings of each number of samples");
DEFINE_int32(coverage, 0, "recordings of 200 samples whose 95 % intervals are compared with truth");
DEFINE_int32(swing_ups, 0, "random starts, with the true and with learned numbers (200 samples)");
DEFINE_bool(timing, false, "the cost of a plan, beside finite differences");
DEFINE_string(plant, "equations", "what is controlled: equations or mujoco");
DEFINE_int32(seed, 1, "of the first recording and of random starts");
DEFINE_int32(threads, 0, "0: one a core; results do not depend on it");
DEFINE_bool(quick, false, "two seeds, 50 and 200 samples, short training");
DEFINE_string(out, "", "file of all results (JSON)");
DEFINE_string(prediction_plot, "", "file of prediction errors over the horizon (SVG)");
DEFINE_string(reward_plot, "", "file of rewards over samples (SVG)");
DEFINE_string(view, "", "file of an animated swing-up with learned numbers (HTML)");

namespace tangible {
namespace {

// What must hold after kSamples samples.
constexpr int kSamples = 200;
constexpr double kLeastErrorRatio = 100.0;  // perceptron over engine, one step ahead
constexpr double kLeastCovered = 0.9, kMostCovered = 0.99;
constexpr double kLeastTrue = 0.99, kLeastLearned = 0.95;
// Real time: this share of plans within a step.
constexpr double kInTime = 0.999;

std::vector<double> OfCells(const std::vector<std::vector<CartPoleCell>>& seeds, int model,
                            const std::function<double(const CartPoleCell&)>& value) {
  std::vector<double> values;
  values.reserve(seeds.size());
  for (const std::vector<CartPoleCell>& cells : seeds) values.push_back(value(cells[model]));
  return values;
}

Quartiles RewardOf(const std::vector<std::vector<CartPoleCell>>& seeds, int model) {
  return QuartilesOf(OfCells(seeds, model, [](const CartPoleCell& c) { return c.reward; }));
}

Quartiles ErrorOf(const std::vector<std::vector<CartPoleCell>>& seeds, int model, size_t horizon) {
  return QuartilesOf(
      OfCells(seeds, model, [&](const CartPoleCell& c) { return c.errors[horizon]; }));
}

bool PrintCurves(const CartPoleStudyOptions& options, const CartPoleCurves& curves) {
  std::printf(
      "pole's tip 1, 10 and 100 steps ahead, rms error in m, and reward of a swing-up from "
      "rest: medians (quartiles) over %d seeds\n",
      options.seeds);
  bool holds = true;
  for (size_t i = 0; i < curves.size(); ++i) {
    for (int model = 0; model < kNumCartPoleModels; ++model) {
      std::printf("%5d samples  %-10s", options.samples[i], kCartPoleModels[model]);
      for (const size_t horizon : {size_t{0}, size_t{3}, std::size(kHorizons) - 1}) {
        const Quartiles error = ErrorOf(curves[i], model, horizon);
        std::printf("  %8.2g (%.2g to %.2g)", error.median, error.low, error.high);
      }
      const Quartiles reward = RewardOf(curves[i], model);
      std::printf("  %.3f (%.3f to %.3f)\n", reward.median, reward.low, reward.high);
    }
    const double ratio = ErrorOf(curves[i], 1, 0).median / ErrorOf(curves[i], 0, 0).median;
    if (options.samples[i] != kSamples) continue;
    std::printf("one step ahead the perceptron's error is %.0f times the engine's", ratio);
    if (options.plant == PlantKind::kMujoco) {
      std::printf("; the engine's is that of MuJoCo's integrator, which is of first order\n");
      continue;
    }
    std::printf(" (expected at least %g)", kLeastErrorRatio);
    holds = PrintBound(ratio >= kLeastErrorRatio, "") && holds;
  }
  return holds;
}

OrderedJson Summary(const Quartiles& quartiles) {
  return {{"lower_quartile", quartiles.low},
          {"median", quartiles.median},
          {"upper_quartile", quartiles.high}};
}

OrderedJson DescribeCell(int model, const CartPoleCell& cell) {
  OrderedJson json = {{"model", kCartPoleModels[model]},
                      {"errors", cell.errors},
                      {"reward", cell.reward},
                      {"success", cell.success}};
  if (model == 0) {
    json["estimates"] = cell.estimates;
    json["low"] = cell.low;
    json["high"] = cell.high;
  } else {
    json["width"] = cell.tuned.perceptron.width;
    json["depth"] = cell.tuned.perceptron.depth;
    json["rate"] = cell.tuned.perceptron.rate;
    json["half_window"] = cell.tuned.half_window;
  }
  return json;
}

OrderedJson DescribeCurves(const CartPoleStudyOptions& options, const CartPoleCurves& curves) {
  OrderedJson list = OrderedJson::array();
  for (size_t i = 0; i < curves.size(); ++i) {
    OrderedJson one = {{"samples", options.samples[i]},
                       {"models", OrderedJson::array()},
                       {"runs", OrderedJson::array()}};
    for (int model = 0; model < kNumCartPoleModels; ++model) {
      OrderedJson summary = {{"model", kCartPoleModels[model]},
                             {"reward", Summary(RewardOf(curves[i], model))},
                             {"errors", OrderedJson::array()}};
      for (size_t h = 0; h < std::size(kHorizons); ++h) {
        OrderedJson at = Summary(ErrorOf(curves[i], model, h));
        at["steps"] = kHorizons[h];
        summary["errors"].push_back(at);
      }
      one["models"].push_back(summary);
    }
    for (int seed = 0; seed < options.seeds; ++seed) {
      for (int model = 0; model < kNumCartPoleModels; ++model) {
        OrderedJson cell = DescribeCell(model, curves[i][seed][model]);
        cell["seed"] = options.seed + static_cast<unsigned>(seed);
        one["runs"].push_back(cell);
      }
    }
    list.push_back(one);
  }
  return list;
}

PlotSeries Band(const std::string& label) {
  PlotSeries series;
  series.label = label;
  series.style = PlotStyle::kLineAndPoints;
  return series;
}

std::string RewardPlot(const CartPoleStudyOptions& options, const CartPoleCurves& curves) {
  std::vector<PlotSeries> all;
  for (int model = 0; model < kNumCartPoleModels; ++model) {
    PlotSeries& series = all.emplace_back(Band(kCartPoleModels[model]));
    for (size_t i = 0; i < curves.size(); ++i) {
      const Quartiles reward = RewardOf(curves[i], model);
      series.x.push_back(options.samples[i]);
      series.y.push_back(reward.median);
      series.error.push_back(0.5 * (reward.high - reward.low));
    }
  }
  return PlotSvg({.title = "Reward of a swing-up after so many samples",
                  .x_label = "samples at 50 Hz",
                  .y_label = "mean of (1 + cos angle) / 2",
                  .x_scale = AxisScale::kLogarithmic},
                 all);
}

std::string PredictionPlot(const CartPoleStudyOptions& options, const CartPoleCurves& curves) {
  std::vector<PlotSeries> all;
  for (size_t i = 0; i < curves.size(); ++i) {
    if (options.samples[i] != kSamples && options.samples[i] != options.samples.back()) continue;
    for (int model = 0; model < kNumCartPoleModels; ++model) {
      PlotSeries& series = all.emplace_back(
          Band(kCartPoleModels[model] + (", " + std::to_string(options.samples[i]) + " samples")));
      for (size_t h = 0; h < std::size(kHorizons); ++h) {
        series.x.push_back(kHorizons[h]);
        series.y.push_back(ErrorOf(curves[i], model, h).median);
      }
    }
  }
  return PlotSvg({.title = "Prediction of the pole's tip",
                  .x_label = "steps of 20 ms ahead",
                  .y_label = "rms error (m), median over seeds",
                  .x_scale = AxisScale::kLogarithmic,
                  .y_scale = AxisScale::kLogarithmic},
                 all);
}

bool PrintCoverage(const CartPoleStudyOptions& options, OrderedJson* json) {
  Progress progress("recordings", FLAGS_coverage);
  const CartPoleCoverage coverage =
      RunCoverage(options, FLAGS_coverage, kSamples, [&](long done, long) { progress.Show(done); });
  const std::vector<std::string> names = {"cart mass", "pole mass", "length", "cart damping",
                                          "pole damping"};
  bool holds = true;
  OrderedJson list = OrderedJson::array();
  for (size_t i = 0; i < names.size(); ++i) {
    const double share = static_cast<double>(coverage.covered[i]) / coverage.seeds;
    std::printf(
        "%-13s 95 %% intervals contain it in %.1f %% of %d recordings, largest error "
        "%.3g %%\n",
        names[i].c_str(), 100.0 * share, coverage.seeds, 100.0 * coverage.largest_off[i]);
    holds = holds && share >= kLeastCovered && share <= kMostCovered;
    list.push_back(
        {{"name", names[i]}, {"covered", share}, {"largest_error", coverage.largest_off[i]}});
  }
  (*json)["coverage"] = {{"recordings", coverage.seeds}, {"samples", kSamples}, {"numbers", list}};
  return PrintBound(holds, "each within 90 to 99 %");
}

bool PrintSwingUps(const CartPoleStudyOptions& options, OrderedJson* json) {
  Progress progress("swing-ups", FLAGS_swing_ups);
  const SwingUpTable table = RunSwingUps(options, FLAGS_swing_ups, kSamples,
                                         [&](long done, long) { progress.Show(done); });
  const size_t plans = table.cpu_seconds.size();
  const auto within =
      std::upper_bound(table.cpu_seconds.begin(), table.cpu_seconds.end(), kCartPoleStep) -
      table.cpu_seconds.begin();
  const double share = plans == 0 ? 0.0 : static_cast<double>(within) / static_cast<double>(plans);
  const double worst = plans == 0 ? NAN : table.cpu_seconds.back();
  std::printf(
      "plant %s: %d of %d random starts swung up with the true numbers, %d with learned "
      "ones\n",
      NameOf(options.plant), table.with_truth, table.starts, table.with_learned);
  std::printf(
      "%.3f %% of %zu plans took at most 20 ms of CPU time (goal %g %%), the median %.2f "
      "ms, the worst %.2f ms\n",
      100.0 * share, plans, 100.0 * kInTime, plans == 0 ? NAN : 1e3 * table.cpu_seconds[plans / 2],
      1e3 * worst);
  (*json)["swing_ups"] = {{"starts", table.starts},
                          {"with_true_numbers", table.with_truth},
                          {"with_learned_numbers", table.with_learned},
                          {"plans", plans},
                          {"plans_in_time", share},
                          {"cpu_seconds_median", plans == 0 ? NAN : table.cpu_seconds[plans / 2]},
                          {"cpu_seconds_max", worst}};
  return PrintBound(table.with_truth >= kLeastTrue * table.starts &&
                        table.with_learned >= kLeastLearned * table.starts,
                    "at least 99 % and 95 %");
}

void PrintTiming(const CartPoleStudyOptions& options, OrderedJson* json) {
  const PlanCost cost = MeasurePlan(options);
  std::printf("%d steps: rollout %.3f ms, with the steps' Jacobians %.3f ms (%.2f rollouts)\n",
              options.swing_up.horizon, 1e3 * cost.rollout, 1e3 * cost.linearised,
              cost.linearised / cost.rollout);
  std::printf("an iteration of iLQR %.3f ms, with finite differences %.3f ms\n",
              1e3 * cost.iteration, 1e3 * cost.differences);
  (*json)["timing"] = {{"rollout_seconds", cost.rollout},
                       {"linearised_seconds", cost.linearised},
                       {"iteration_seconds", cost.iteration},
                       {"iteration_by_differences_seconds", cost.differences}};
}

// A swing-up with numbers that were learned from the first recording.
std::string View(const CartPoleStudyOptions& options) {
  const std::unique_ptr<CartPolePlant> plant = MakePlant(options.plant, options.truth);
  const CartPoleEstimate estimate =
      EstimateCartPole(RecordRandomly(plant.get(), kSamples, options.seed));
  CartPoleStep step(estimate.ok ? estimate.numbers : options.truth);
  const SwingUp run = RunSwingUp(&step, plant.get(), {0.0, M_PI, 0.0, 0.0}, options.swing_up);
  Model<double> model;
  State<double> state;
  Scene scene = CartPoleScene(options.truth);
  BuildModel(scene, &model, &state);
  ViewRecorder view(scene, model);
  PlotSeries force, angle;
  force.label = "force (N)";
  angle.label = "angle (rad)";
  for (size_t k = 0; k < run.states.size(); ++k) {
    const double time = static_cast<double>(k) * kCartPoleStep;
    SetCartPoleState(options.truth, run.states[k], &state);
    view.Add(model, time, state, nullptr);
    angle.x.push_back(time);
    angle.y.push_back(run.states[k][1]);
    if (k == run.forces.size()) break;
    force.x.insert(force.x.end(), {time, time + kCartPoleStep});
    force.y.insert(force.y.end(), 2, run.forces[k]);
  }
  ViewOptions view_options;
  view_options.below =
      PlotSvg({.title = "Force on the cart", .x_label = "time (s)", .y_label = "N"}, {force}) +
      PlotSvg({.title = "Angle of the pole", .x_label = "time (s)", .y_label = "rad"}, {angle});
  return ViewHtml(view.data(), view_options);
}

std::string CheckFlags(CartPoleStudyOptions* options) {
  if (FLAGS_plant != "equations" && FLAGS_plant != "mujoco") {
    return "--plant: expected equations or mujoco, got " + FLAGS_plant;
  }
  options->plant = FLAGS_plant == "mujoco" ? PlantKind::kMujoco : PlantKind::kEquations;
  std::string outside = FirstOutside({{"--seeds", FLAGS_seeds, 1},
                                      {"--coverage", FLAGS_coverage, 0},
                                      {"--swing_ups", FLAGS_swing_ups, 0},
                                      {"--seed", FLAGS_seed, 0},
                                      {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  const std::vector<int> samples = WholeNumbersAtCommas(FLAGS_samples, 20, 100000);
  if (samples.empty() ||
      std::adjacent_find(samples.begin(), samples.end(), std::greater_equal<>()) != samples.end()) {
    return "--samples: expected ascending numbers from 20 to 100000, got " + FLAGS_samples;
  }
  options->samples = samples;
  options->seeds = FLAGS_seeds;
  options->seed = static_cast<unsigned>(FLAGS_seed);
  options->threads = FLAGS_threads;
  if (FLAGS_quick) {
    options->seeds = 2;
    options->samples = {50, kSamples};
    options->updates = 300;
    options->swing_up.steps = 150;
  }
  return "";
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-cartpole",
       .synopsis = "[--seeds=10] [--samples=25,50] [--coverage=200] [--swing_ups=100] [--timing] "
                   "[--plant=mujoco] [--out=R.json] [--view=V.html]",
       .description =
           "Learns the masses, length and frictions of a cart and pole from random motion with "
           "noise,\nand swings it up with plans over what was learned, beside perceptrons that "
           "learn the same.\nExits with 1 where a bound that it prints does not hold.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "prediction_plot", "reward_plot", "view"}});
  if (line.exit_status) return *line.exit_status;
  CartPoleStudyOptions options;
  const std::string wrong = CheckFlags(&options);
  if (!wrong.empty()) return ReportError("tangible-cartpole: " + wrong, kExitUsage);
  if (MakePlant(options.plant, options.truth) == nullptr) {
    return ReportError(
        "tangible-cartpole: --plant: expected equations, as MuJoCo was not found "
        "when this was built, got mujoco");
  }
  Progress progress("recordings", static_cast<long>(options.samples.size()) * options.seeds);
  const CartPoleCurves curves = RunCurves(options, [&](long done, long) { progress.Show(done); });
  OrderedJson json = {{"plant", NameOf(options.plant)},
                      {"truth", NumbersOf(options.truth)},
                      {"noise", {{"x", kPositionNoise}, {"angle", kAngleNoise}}},
                      {"curves", DescribeCurves(options, curves)}};
  bool holds = PrintCurves(options, curves);
  if (FLAGS_coverage > 0) holds = PrintCoverage(options, &json) && holds;
  if (FLAGS_swing_ups > 0) holds = PrintSwingUps(options, &json) && holds;
  if (FLAGS_timing) PrintTiming(options, &json);
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] { return JsonText(json); });
  writer.Write(FLAGS_prediction_plot, [&] { return PredictionPlot(options, curves); });
  writer.Write(FLAGS_reward_plot, [&] { return RewardPlot(options, curves); });
  writer.Write(FLAGS_view, [&] { return View(options); });
  if (!writer.error().empty()) return ReportError(writer.error());
  return holds ? kExitDone : kExitFailed;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
