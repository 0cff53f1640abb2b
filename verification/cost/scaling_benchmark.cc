// SPDX-License-Identifier: Apache-2.0
//
// The cost of a settled step by size, compared with the engines that Debian ships: the same scene,
// in one process, CPU time. Growth exponents are those of the last two sizes of a family.
//
// Counters: `apart` is the distance of the mean position of all bodies from ours when timing starts
// (m); `factorisations` and `residual` (largest) are of the timed steps; `rollouts` is the time of
// an adjoint (recording included) in units of the plain rollout; MB is the memory of the engine.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tangible/math/cpu_time.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/verification/cost/benchmark_scenes.h"
#include "tangible/verification/cost/peers.h"

namespace tangible {
namespace {

struct Family {
  std::string name;
  std::function<Scene(int)> scene;
  int settle;  ///< steps before timing
  int timed;
  std::vector<int> sizes;
  std::vector<int> peer_sizes;
};

double HeapMegabytes() { return 1e-6 * static_cast<double>(mallinfo2().uordblks); }

Vector2<double> MeanPosition(const Scene& scene,
                             const std::function<Vector2<double>(int)>& position) {
  Vector2<double> sum(0.0, 0.0);
  int count = 0;
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].motion == Motion::kMoving) {
      sum += position(static_cast<int>(i));
      ++count;
    }
  }
  return Vector2<double>(sum / count);
}

// A run that has settled; made once for each scene.
struct Settled {
  Settled(const Scene& scene, int steps) : scene(scene) {
    BuildModel(scene, &model, &state);
    const double before = HeapMegabytes();
    stepper = std::make_unique<Stepper>(model);
    for (int k = 0; k < steps && solved; ++k) {
      Step();
    }
    megabytes = HeapMegabytes() - before;
    settled = MeanPosition(scene, [this](int body) { return state.PoseOf(body).position; });
  }
  StepReport Step() {
    StepReport report = stepper->Step(model, time, scene.simulation.dt, &state);
    solved = solved && report.status == StepStatus::kDone;
    time += scene.simulation.dt;
    return report;
  }
  Scene scene;
  Model<double> model;
  State<double> state;
  std::unique_ptr<Stepper> stepper;
  double time = 0.0;
  double megabytes = 0.0;
  Vector2<double> settled;  // mean position when timing starts
  bool solved = true;
};

Settled& SettledRun(const Family& family, int size) {
  static std::map<std::pair<std::string, int>, std::unique_ptr<Settled>> runs;
  std::unique_ptr<Settled>& run = runs[{family.name, size}];
  if (!run) {
    run = std::make_unique<Settled>(family.scene(size), family.settle);
  }
  return *run;
}

void TimeSteps(benchmark::State& state, const Family& family, int size) {
  Settled& run = SettledRun(family, size);
  double factorisations = 0.0;
  double residual = 0.0;
  long steps = 0;
  for (auto _ : state) {
    const StepReport report = run.Step();
    factorisations += report.factorisations;
    residual = std::max(residual, report.residual);
    ++steps;
  }
  if (!run.solved) {
    state.SkipWithError("a step was not solved");
  }
  state.counters["factorisations"] = factorisations / static_cast<double>(steps);
  state.counters["residual"] = residual;
  state.counters["MB"] = run.megabytes;
}

void TimePeer(benchmark::State& state, const Family& family, int size,
              std::unique_ptr<Peer> (*make)(const Scene&)) {
  const Settled& run = SettledRun(family, size);
  const std::unique_ptr<Peer> peer = make(run.scene);
  for (int k = 0; k < family.settle; ++k) {
    peer->Step();
  }
  const Vector2<double> theirs =
      MeanPosition(run.scene, [&](int body) { return peer->PositionOf(body); });
  state.counters["apart"] = (run.settled - theirs).norm();
  for (auto _ : state) {
    peer->Step();
  }
}

// The gradient of one coordinate at the end of `timed` steps from the settled state.
void TimeAdjoint(benchmark::State& state, const Family& family, int size) {
  const Settled& run = SettledRun(family, size);
  Scene scene = run.scene;
  scene.simulation.duration = family.timed * scene.simulation.dt;
  Model<double> model;
  State<double> unused;
  BuildModel(scene, &model, &unused);
  Stepper stepper(model);
  State<double> final;
  double rollout = HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const double start = ThreadCpuSeconds();
    Rollout(model, run.state, StateObserver(), &stepper, &final);
    rollout = std::min(rollout, ThreadCpuSeconds() - start);
  }
  RolloutTape tape;
  RowMatrixXd w_bar;
  const long last = NumSteps(scene.simulation);
  double best = HUGE_VAL;
  for (auto _ : state) {
    const double start = ThreadCpuSeconds();
    tape.Record(model, run.state, Factorisations::kKeep, StateObserver(), &final);
    tape.Adjoint(
        model, 1, [&](long k, RowMatrixXd* w) { (*w)(0, 0) += k == last ? 1.0 : 0.0; }, &w_bar);
    best = std::min(best, ThreadCpuSeconds() - start);
  }
  state.counters["rollouts"] = best / rollout;
  state.counters["MB"] = 1e-6 * static_cast<double>(tape.bytes());
}

// Prints the usual output, and keeps the times of our steps.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(OO_None) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      times_[run.run_name.function_name] = run.GetAdjustedCPUTime();
    }
    ConsoleReporter::ReportRuns(runs);
  }
  void PrintGrowth(const std::vector<Family>& families) const {
    std::printf("\ngrowth exponents of a step's time\n");
    for (const Family& family : families) {
      double last_time = 0.0;
      double last_size = 0.0;
      for (const int size : family.sizes) {
        const auto found = times_.find(family.name + "/step/" + std::to_string(size));
        if (found == times_.end()) {
          continue;
        }
        const int bodies = static_cast<int>(family.scene(size).bodies.size());
        if (last_size > 0.0) {
          std::printf("%-10s %5d to %5d bodies   %.2f\n", family.name.c_str(),
                      static_cast<int>(last_size), bodies,
                      std::log(found->second / last_time) / std::log(bodies / last_size));
        }
        last_time = found->second;
        last_size = bodies;
      }
    }
  }

 private:
  std::map<std::string, double> times_;
};

std::vector<Family> Families() {
  return {
      {"discs", DiscsScene, 2000, 500, {10, 50, 100, 300}, {10, 50, 100}},
      {"piles",
       [](int discs) { return PilesScene(discs / 10, 10); },
       2000,
       50,
       {10, 100, 1000, 10000},
       {}},
      {"pyramid", PyramidScene, 300, 100, {10, 20, 40}, {10, 20}},
      {"chain", ChainScene, 50, 500, {10, 100, 1000}, {10}},
  };
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) {
  using namespace tangible;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) {
    return 2;
  }
  const std::vector<Family> families = Families();
  const bool has_mujoco = MujocoPeer(ChainScene(1)) != nullptr;
  const bool has_box2d = Box2dPeer(ChainScene(1)) != nullptr;
  std::printf("MuJoCo %s, Box2D %s\n", has_mujoco ? "installed" : "not installed",
              has_box2d ? "installed" : "not installed");
  for (const Family& family : families) {
    for (const int size : family.sizes) {
      const std::string of_size = "/" + std::to_string(size);
      const auto name = [&](const char* what) { return family.name + what + of_size; };
      benchmark::RegisterBenchmark(name("/step").c_str(), TimeSteps, family, size)
          ->Iterations(family.timed)
          ->Unit(benchmark::kMicrosecond);
      benchmark::RegisterBenchmark(name("/adjoint").c_str(), TimeAdjoint, family, size)
          ->Iterations(3)
          ->Unit(benchmark::kMillisecond);
    }
    for (const int size : family.peer_sizes) {
      const std::string of_size = "/" + std::to_string(size);
      if (has_mujoco && family.name != "pyramid") {
        benchmark::RegisterBenchmark((family.name + "/mujoco" + of_size).c_str(), TimePeer, family,
                                     size, MujocoPeer)
            ->Iterations(family.timed)
            ->Unit(benchmark::kMicrosecond);
      }
      if (has_box2d) {
        benchmark::RegisterBenchmark((family.name + "/box2d" + of_size).c_str(), TimePeer, family,
                                     size, Box2dPeer)
            ->Iterations(family.timed)
            ->Unit(benchmark::kMicrosecond);
      }
    }
  }
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.PrintGrowth(families);
  return 0;
}
