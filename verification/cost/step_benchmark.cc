// SPDX-License-Identifier: Apache-2.0
//
// The cost of steps and their derivatives: the chain that a ball hits (11 bodies, 10 joints, 1
// contact at a time) and ten discs in a box. Times are CPU time; ratios to the plain rollout of the
// same run are counters.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/math/cpu_time.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/verification/cost/benchmark_scenes.h"

namespace tangible {
namespace {

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
      const double start = ThreadCpuSeconds();
      Rollout(model, initial, StateObserver(), &stepper, &final);
      best = std::min(best, ThreadCpuSeconds() - start);
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
    const double start = ThreadCpuSeconds();
    benchmark::DoNotOptimize(Rollout(c.model, c.initial, StateObserver(), &stepper, &final));
    best = std::min(best, ThreadCpuSeconds() - start);
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
    const double start = ThreadCpuSeconds();
    tape.Record(c.model, c.initial, factorisations, StateObserver(), &final);
    tape.Adjoint(c.model, 1, seed, &w_bar);
    best = std::min(best, ThreadCpuSeconds() - start);
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
    const double start = ThreadCpuSeconds();
    RolloutTangent(c.model, c.initial, TangentObserver(), &w_dot, &final);
    best = std::min(best, ThreadCpuSeconds() - start);
  }
  state.counters["rollouts"] = best / rollout;
}

// The entries of ∂R/∂w of one step, times one column of the adjoint: bodies, hinges and contacts by
// hand, or all elements by their templates in Jets.
void BenchmarkJacobian(benchmark::State& state, const Scene& scene, JacobianRoute route) {
  Case c(scene);
  Stepper stepper(c.model);
  State<double> at = c.initial;
  const double h = scene.simulation.dt;
  for (int k = 0; k < 300; ++k) {
    stepper.Step(c.model, k * h, h, &at);
  }
  const SolvedEquations step = stepper.record().View(stepper.system().contact_block());
  const std::vector<double> u(3 * static_cast<size_t>(stepper.system().num_blocks()), 1.0);
  std::vector<double> w_bar(static_cast<size_t>(c.model.structure->num_variables()), 0.0);
  LocalJacobianScratch scratch;
  for (auto _ : state) {
    VisitJacobian(c.model, step, route, &scratch, SingleAdjointSink{u.data(), w_bar.data()});
    benchmark::DoNotOptimize(w_bar.data());
  }
}

// The linear system of a step of `discs` settled discs without friction, factorised and solved;
// with angles that are coupled by a negligible entry, or without angles.
void BenchmarkDiscSystem(benchmark::State& state, double arm) {
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
  ContactProblem<double> problem = stepper.record().problem;
  const std::vector<ContactMode> modes = stepper.record().solution.modes;
  for (ContactBlock<double>& contact : problem.contacts) {
    contact.normal_a[2] = arm;
    contact.normal_b[2] = -arm;
  }
  ContactSystem system;
  std::vector<double> x;
  for (auto _ : state) {
    system.Factor(problem, modes);
    x.assign(3 * static_cast<size_t>(system.num_blocks()), 0.0);
    std::copy(problem.load.begin(), problem.load.end(), x.begin());
    benchmark::DoNotOptimize(system.SolveProximal(problem, modes, x.data(), 1));
  }
  std::vector<Turning> turning;
  FindTurning(problem, &turning);
  state.counters["angles_left_out"] = CountAnglesLeftOut(turning);
}

BENCHMARK_CAPTURE(BenchmarkRollout, chain, Chain())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkAdjoint, chain_keep, Chain(), Factorisations::kKeep)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkAdjoint, chain_recompute, Chain(), Factorisations::kRecompute)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkJacobian, chain_by_hand, Chain(), JacobianRoute::kByHand);
BENCHMARK_CAPTURE(BenchmarkJacobian, chain_by_templates, Chain(), JacobianRoute::kGeneric);
BENCHMARK_CAPTURE(BenchmarkJacobian, discs_10_by_hand, DiscsScene(10), JacobianRoute::kByHand);
BENCHMARK_CAPTURE(BenchmarkJacobian, discs_10_by_templates, DiscsScene(10),
                  JacobianRoute::kGeneric);
BENCHMARK_CAPTURE(BenchmarkTangent, chain, Chain())
    ->Arg(1)
    ->Arg(8)
    ->Arg(32)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkRollout, discs_10, DiscsScene(10))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BenchmarkDiscSystem, without_angles, 0.0)
    ->Arg(100)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BenchmarkDiscSystem, with_angles, 1e-30)->Arg(100)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(BenchmarkAdjoint, discs_10_keep, DiscsScene(10), Factorisations::kKeep)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tangible
