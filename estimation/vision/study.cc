// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "tangible/estimation/vision/evaluation.h"
#include "tangible/estimation/vision/tolerances.h"
#include "tangible/estimation/vision/training.h"
#include "tangible/math/cpu_time.h"
#include "tangible/math/median.h"

namespace tangible {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr int kCurvePoints = 40;  // of a loss over a training
constexpr int kTestStride = 3;    // frames between windows that billiards are tested on

std::string Format(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

StudyCell CellOf(DiscKind kind, DynamicsKind dynamics, int percent, std::uint64_t seed) {
  StudyCell cell;
  cell.kind = kind;
  cell.name = std::string(NameOf(kind)) + "_" + NameOf(dynamics) + "_" + std::to_string(percent) +
              "_" + std::to_string(seed);
  cell.training.dynamics = dynamics;
  cell.training.labels = percent / 100.0;
  cell.training.seed = seed;
  cell.training.batch = 16;
  cell.training.iterations = kind == DiscKind::kSimb ? 2000 : 1000;
  cell.training.learning_rate = kind == DiscKind::kSimb ? 3e-3 : 2e-3;
  cell.training.seen = kind == DiscKind::kSimb ? kSimbSeen : 3;
  // The rules of SimB are known: three equal elastic discs.
  cell.training.learns_parameters = kind == DiscKind::kBilliards;
  return cell;
}

OrderedJson ToJson(const ScoreSummary& score) {
  return {{"mean", score.mean},
          {"lower_quartile", score.lower_quartile},
          {"median", score.median},
          {"upper_quartile", score.upper_quartile}};
}

OrderedJson ToJson(const SimbScore& score) {
  return {{"near", ToJson(score.near)},
          {"far", ToJson(score.far)},
          {"windows", score.windows},
          {"unsolved", score.unsolved}};
}

OrderedJson SimbJson(Trainer* trainer, const StudyData& data, OrderedJson* seen_error) {
  const DiscData& test = data.test;
  const std::vector<double> positions = SeePositions(trainer, test);
  *seen_error = SeenError(positions, test);
  const std::ptrdiff_t size = 2 * static_cast<std::ptrdiff_t>(test.world.size());
  const SeenPositions seen = [&](int sequence, int frame) {
    return positions.data() + size * (static_cast<std::ptrdiff_t>(sequence) * test.frames + frame);
  };
  OrderedJson json;
  json["ours"] = ToJson(ScoreSimb(test, SimbPredictor::kEngine, seen, 1));
  json["true state"] = ToJson(data.floor);
  json["constant velocity"] = ToJson(ScoreSimb(test, SimbPredictor::kConstantVelocity, seen, 1));
  json["last frame"] = ToJson(ScoreSimb(test, SimbPredictor::kLastFrame, seen, 1));
  return json;
}

OrderedJson HorizonJson(Trainer* trainer, const DiscData& test) {
  OrderedJson json;
  for (const Predictor predictor : {Predictor::kModel, Predictor::kConstantVelocity,
                                    Predictor::kLastFrame, Predictor::kTruth}) {
    const HorizonErrors errors = Evaluate(trainer, test, predictor, kTestStride);
    json[NameOf(predictor)] = {{"position", errors.position},
                               {"position_median", errors.position_median},
                               {"picture", errors.picture},
                               {"windows", errors.windows},
                               {"unsolved", errors.unsolved}};
  }
  return json;
}

OrderedJson ParametersJson(const Dynamics& dynamics, const DiscWorld& world) {
  std::vector<double> truth;
  for (int i = 1; i < world.size(); ++i) truth.push_back(world.masses[i] / world.masses[0]);
  truth.insert(truth.end(), {world.disc_restitution, world.side_restitution, world.end_restitution,
                             world.linear_damping});
  const at::Tensor values = dynamics->PhysicalParameters().detach().contiguous();
  OrderedJson json = OrderedJson::array();
  for (size_t k = 0; k < truth.size(); ++k) {
    json.push_back({{"name", dynamics->parameter_names()[k]},
                    {"estimate", values.data_ptr<double>()[k]},
                    {"truth", truth[k]}});
  }
  return json;
}

// The mean losses of a training over equal parts of it.
class LossCurve {
 public:
  explicit LossCurve(long iterations) : part_(std::max(1L, iterations / kCurvePoints)) {}
  void Add(long iteration, const TrainingLoss& loss) {
    sum_ += loss.total;
    ++count_;
    if (iteration % part_ != 0) return;
    json_.push_back({iteration, sum_ / static_cast<double>(count_)});
    sum_ = 0.0;
    count_ = 0;
  }
  const OrderedJson& json() const { return json_; }

 private:
  long part_;
  double sum_ = 0.0;
  long count_ = 0;
  OrderedJson json_ = OrderedJson::array();
};

}  // namespace

std::vector<StudyCell> StudyCells() {
  std::vector<StudyCell> cells;
  for (const int percent : {10, 100, 25, 2}) {
    const std::uint64_t seeds = percent == 10 ? 3 : 1;
    for (std::uint64_t seed = 0; seed < seeds; ++seed) {
      cells.push_back(CellOf(DiscKind::kSimb, DynamicsKind::kEngine, percent, seed));
      for (const DynamicsKind dynamics :
           {DynamicsKind::kEngine, DynamicsKind::kPerceptron, DynamicsKind::kInteraction}) {
        cells.push_back(CellOf(DiscKind::kBilliards, dynamics, percent, seed));
      }
    }
  }
  StudyCell renderer = CellOf(DiscKind::kBilliards, DynamicsKind::kEngine, 10, 0);
  renderer.name = "billiards_renderer_10_0";
  renderer.training.decoder = DecoderKind::kRenderer;
  cells.push_back(renderer);
  StudyCell no_physics = CellOf(DiscKind::kBilliards, DynamicsKind::kEngine, 10, 0);
  no_physics.name = "billiards_no_physics_loss_10_0";
  no_physics.training.physics_loss = false;
  cells.push_back(no_physics);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    StudyCell parameters = CellOf(DiscKind::kBilliards, DynamicsKind::kEngine, 0, seed);
    parameters.name = "parameters_" + std::to_string(seed);
    parameters.training.decoder = DecoderKind::kRenderer;
    parameters.training.starts_from_colours = true;
    parameters.training.self_consistency = true;
    cells.push_back(parameters);
  }
  return cells;
}

StudyData MakeStudyData(DiscKind kind, std::uint64_t seed) {
  const bool simb = kind == DiscKind::kSimb;
  DiscDataOptions options{.kind = kind,
                          .sequences = simb ? 1000 : 500,
                          .frames = simb ? 100 : 30,
                          .seed = 2 * seed + 1};
  StudyData data;
  data.train = MakeDiscData(options);
  options.seed = 2 * seed + 2;
  options.sequences = simb ? 1000 : 200;
  data.test = MakeDiscData(options);
  if (simb) data.floor = ScoreSimbFromTruth(data.test, 1);
  return data;
}

CellResult RunCell(const StudyCell& cell, const StudyData& data, const CellHooks& hooks,
                   std::string* error) {
  // Weights are drawn from torch's generator, which all threads share.
  static std::mutex drawing;
  std::unique_ptr<Trainer> trainer;
  {
    const std::lock_guard<std::mutex> lock(drawing);
    trainer = std::make_unique<Trainer>(data.train, cell.training);
  }
  CellResult result;
  if (hooks.checkpoint && !trainer->Load(*hooks.checkpoint, cell.name + ": checkpoint", error)) {
    return result;
  }
  LossCurve curve(cell.training.iterations);
  const double start = ThreadCpuSeconds();
  const long from = trainer->iteration();
  while (trainer->iteration() < cell.training.iterations) {
    const TrainingLoss loss = trainer->Step();
    const long iteration = trainer->iteration();
    curve.Add(iteration, loss);
    if (hooks.progress) hooks.progress(iteration);
    const bool last = iteration == cell.training.iterations;
    if (hooks.save && (last || iteration % hooks.save_every == 0)) {
      hooks.save(iteration, trainer->Save());
    }
  }
  OrderedJson& json = result.json;
  json["cell"] = cell.name;
  json["labels"] = cell.training.labels;
  json["iterations"] = cell.training.iterations;
  json["batch"] = cell.training.batch;
  json["iterations_now"] = cell.training.iterations - from;
  json["cpu_seconds"] = ThreadCpuSeconds() - start;
  json["loss"] = curve.json();
  if (cell.kind == DiscKind::kSimb) {
    OrderedJson seen_error;
    json["simb"] = SimbJson(trainer.get(), data, &seen_error);
    json["seen_error"] = seen_error;
    return result;
  }
  json["seen_error"] = SeenError(SeePositions(trainer.get(), data.test), data.test);
  if (cell.training.dynamics == DynamicsKind::kEngine) {
    json["parameters"] = ParametersJson(trainer->dynamics(), data.train.world);
  }
  json["ahead"] = HorizonJson(trainer.get(), data.test);
  const PictureRows rows = DecodeWindow(trainer.get(), data.test, 0);
  result.truth = rows.truth;
  result.predicted = rows.predicted;
  return result;
}

nlohmann::ordered_json TimePhysics() {
  constexpr int kRepeats = 9;
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 40, .frames = 30, .seed = 5});
  TrainingOptions options;
  options.batch = 32;
  Trainer trainer(data, options);
  std::vector<std::pair<int, int>> frames;
  for (int row = 0; row < options.batch; ++row) frames.emplace_back(row, row % 10);
  std::vector<double> iterations, physics;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    double start = ThreadCpuSeconds();
    trainer.Step();
    iterations.push_back(ThreadCpuSeconds() - start);
    const at::Tensor state = StatesOf(data, frames).requires_grad_();
    start = ThreadCpuSeconds();
    trainer.dynamics()(state).states.square().sum().backward();
    physics.push_back(ThreadCpuSeconds() - start);
  }
  return {{"batch", options.batch},
          {"frames", options.ahead},
          {"physics_seconds", UpperMedian(physics)},
          {"iteration_seconds", UpperMedian(iterations)},
          {"share", UpperMedian(physics) / UpperMedian(iterations)}};
}

namespace {

// The largest difference between the layer's gradient of a random combination of states and central
// differences, over the sum of both, for discs that meet.
double GradientError() {
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 6, .frames = 12, .seed = 3});
  RolloutLayer layer;
  const std::string wrong = layer.Create(SceneOf(data.world, 10),
                                         {.parameters = {"bodies/disc1/mass"}, .records = {5, 10}});
  if (!wrong.empty()) return HUGE_VAL;
  torch::manual_seed(1);
  const at::Tensor planar = StatesOf(data, {{0, 0}, {1, 0}, {2, 0}, {3, 0}}).to(torch::kDouble);
  const at::Tensor zero = torch::zeros({4, 3, 1}, torch::kDouble);
  const at::Tensor state =
      torch::cat({planar.slice(2, 0, 2), zero, planar.slice(2, 2, 4), zero}, 2).reshape({4, 18});
  const at::Tensor weights = torch::randn({4, 2, 18}, torch::kDouble);
  const at::Tensor way = torch::randn({4, 18}, torch::kDouble);
  const at::Tensor mass = torch::tensor({2.0}, torch::kDouble);
  const auto loss = [&](const at::Tensor& p, const at::Tensor& x) {
    return (layer({.parameters = p, .state = x}).states * weights).sum();
  };
  const at::Tensor p = mass.clone().requires_grad_(), x = state.clone().requires_grad_();
  loss(p, x).backward();
  const auto error = [](double a, double b) {
    return std::abs(a - b) / (std::abs(a) + std::abs(b));
  };
  const double by_mass = ((loss(mass + kGradientStep, state) - loss(mass - kGradientStep, state)) /
                          (2.0 * kGradientStep))
                             .item<double>();
  const double by_state =
      ((loss(mass, state + kGradientStep * way) - loss(mass, state - kGradientStep * way)) /
       (2.0 * kGradientStep))
          .item<double>();
  return std::max(error(by_mass, p.grad().item<double>()),
                  error(by_state, (x.grad() * way).sum().item<double>()));
}

// The weights are compared, because files of equal trainings differ: they name tensors by their
// addresses.
bool SameWeights(Trainer* a, Trainer* b) {
  const auto same = [](const torch::nn::Module& one, const torch::nn::Module& other) {
    const std::vector<at::Tensor> mine = one.parameters(), others = other.parameters();
    return std::equal(mine.begin(), mine.end(), others.begin(), others.end(),
                      [](const at::Tensor& x, const at::Tensor& y) { return torch::equal(x, y); });
  };
  return same(*a->encoder(), *b->encoder()) && same(*a->decoder(), *b->decoder()) &&
         same(*a->dynamics(), *b->dynamics());
}

}  // namespace

bool QuickCheck(std::string* lines) {
  bool good = true;
  const auto check = [&](bool holds, const std::string& line) {
    *lines += (holds ? "holds   " : "FAILS   ") + line + "\n";
    good = good && holds;
  };
  const double gradient = GradientError();
  check(gradient < kGradientAgrees,
        "gradient of the physics layer against central differences: relative error " +
            Format("%.1e", gradient) + ", at most " + Format("%.0e", kGradientAgrees));
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 24, .frames = 20, .seed = 1});
  TrainingOptions options;
  options.batch = 8;
  options.iterations = 100;
  options.labels = 0.5;
  Trainer trainer(data, options);
  double first = 0.0, last = 0.0;
  std::string checkpoint;
  for (long k = 0; k < options.iterations; ++k) {
    const double loss = trainer.Step().total;
    if (k < 5) first += loss / 5.0;
    if (k >= options.iterations - 5) last += loss / 5.0;
    if (k == options.iterations - 4) checkpoint = trainer.Save();
  }
  check(last < 0.1 * first, "loss, mean of five iterations: " + Format("%.4g", first) + " to " +
                                Format("%.4g", last) + ", at most a tenth");
  Trainer resumed(data, options);
  std::string error;
  bool same = resumed.Load(checkpoint, "checkpoint", &error);
  while (same && resumed.iteration() < options.iterations) resumed.Step();
  check(same && SameWeights(&resumed, &trainer), "a resumed training ends with the same bits");
  return good;
}

}  // namespace tangible
