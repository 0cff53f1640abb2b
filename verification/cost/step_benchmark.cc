// SPDX-License-Identifier: Apache-2.0
//
// What steps and their derivatives cost: the chain that a ball hits (11 bodies, 10 joints, 1
// contact at a time) and ten discs in a box. Times are CPU time; ratios to the plain rollout of the
// same run are counters.
#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>
#include <string>

#include "tangible/dynamics/parameter_map.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/rollout_adjoint.h"
#include "tangible/simulation/rollout_tangent.h"
#include "tangible/verification/cost/benchmark_scenes.h"

namespace tangible {
namespace {

double CpuSeconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

Scene Chain() {
  Scene scene;
  std::string error;
  if (!LoadScene(std::string(TANGIBLE_SOURCE_DIR) + "/data/scenes/chain.json", &scene, &error)) {
    std::abort();
  }
  return scene;
}

struct Case {
  explicit Case(const Scene& scene) : scene(scene) { BuildModel(scene, &model, &initial); }
  // Minimum of repeats, against which the derivative's time is compared.
  double RolloutSeconds() {
    Stepper stepper(model);
    State<double> final;
    double best = HUGE_VAL;
    for (int i = 0; i < 10; ++i) {
      const double start = CpuSeconds();
      Rollout(model, initial, StateObserver(), &stepper, &final);
      best = std::min(best, CpuSeconds() - start);
    }
    return best;
  }
  Scene scene;
  Model<double> model;
  State<double> initial;
};

void BenchmarkRollout(benchmark::State& state, const Scene& scene) {
  Case c(scene);
  Stepper stepper(c.model);
  State<double> final;
  double best = HUGE_VAL;
  for (auto _ : state) {
    const double start = CpuSeconds();
    benchmark::DoNotOptimize(Rollout(c.model, c.initial, StateObserver(), &stepper, &final));
    best = std::min(best, CpuSeconds() - start);
  }
  state.counters["us_per_step"] = 1e6 * best / static_cast<double>(NumSteps(scene.simulation));
}

// The gradient of one coordinate of the final state with respect to all numbers and the initial
// state.
void BenchmarkAdjoint(benchmark::State& state, const Scene& scene, Factorisations factorisations) {
  Case c(scene);
  const double rollout = c.RolloutSeconds();
  RolloutTape tape;
  State<double> final;
  RowMatrixXd w_bar;
  const long last = NumSteps(scene.simulation);
  const RolloutTape::Seed seed = [&](long k, RowMatrixXd* w) {
    if (k == last) {
      (*w)(0, 0) += 1.0;
    }
  };
  double best = HUGE_VAL;
  for (auto _ : state) {
    const double start = CpuSeconds();
    tape.Record(c.model, c.initial, factorisations, StateObserver(), &final);
    tape.Adjoint(c.model, 1, seed, &w_bar);
    best = std::min(best, CpuSeconds() - start);
  }
  state.counters["rollouts"] = best / rollout;
  state.counters["tape_MB"] = 1e-6 * static_cast<double>(tape.bytes());
}

// Derivatives of all states with respect to `width` directions.
void BenchmarkTangent(benchmark::State& state, const Scene& scene) {
  Case c(scene);
  const double rollout = c.RolloutSeconds();
  const int width = static_cast<int>(state.range(0));
  State<double> final;
  double best = HUGE_VAL;
  for (auto _ : state) {
    RowMatrixXd w_dot = RowMatrixXd::Zero(c.model.structure->num_variables(), width);
    w_dot.topRows(width).setIdentity();
    const double start = CpuSeconds();
    RolloutTangent(c.model, c.initial, TangentObserver(), &w_dot, &final);
    best = std::min(best, CpuSeconds() - start);
  }
  state.counters["rollouts"] = best / rollout;
}

// Discs in a box without friction: no contact exerts a torque, and their angles could be left out
// of what is factorised. What that is of a settled step, by its CPU time, bounds what could be
// gained.
void BenchmarkFrictionlessDiscs(benchmark::State& state) {
  Scene scene = DiscsScene(static_cast<int>(state.range(0)));
  for (BasicBody<double>& body : scene.bodies) {
    body.friction = 0.0;
  }
  Case c(scene);
  Stepper stepper(c.model);
  State<double> at = c.initial;
  const double h = scene.simulation.dt;
  for (int k = 0; k < 1000; ++k) {
    stepper.Step(c.model, k * h, h, &at);
  }
  double step = 0.0;
  double factors = 0.0;
  for (auto _ : state) {
    double start = CpuSeconds();
    const int factorisations = stepper.Step(c.model, 0.0, h, &at).factorisations;
    step += CpuSeconds() - start;
    ContactSystem& system = stepper.system();
    const StepRecord& record = stepper.record();
    start = CpuSeconds();
    for (int k = 0; k < factorisations; ++k) {
      system.Factor(record.problem, record.solution.modes);
    }
    factors += CpuSeconds() - start;
  }
  state.counters["factorisation_of_step"] = factors / step;
}

BENCHMARK_CAPTURE(BenchmarkRollout, chain, Chain())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkAdjoint, chain_keep, Chain(), Factorisations::kKeep)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkAdjoint, chain_recompute, Chain(), Factorisations::kRecompute)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkTangent, chain, Chain())
    ->Arg(1)
    ->Arg(8)
    ->Arg(32)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkRollout, discs_10, DiscsScene(10))->Unit(benchmark::kMillisecond);
BENCHMARK(BenchmarkFrictionlessDiscs)->Arg(100)->Unit(benchmark::kMillisecond)->Iterations(500);
BENCHMARK_CAPTURE(BenchmarkAdjoint, discs_10_keep, DiscsScene(10), Factorisations::kKeep)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tangible
