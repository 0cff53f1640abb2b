// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/replay.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"

namespace tangible {
namespace {

constexpr double kPi = std::numbers::pi;

// ẏ = f(y, u) by the classical method of Runge and Kutta, kParts of its steps in each of the
// controls.
using Rates = std::function<std::array<double, 4>(const std::array<double, 4>&,
                                                  const RowMatrixXd::ConstRowXpr&)>;
std::array<double, 4> Integrate(const Rates& rates, const RowMatrixXd& controls, double dt) {
  constexpr int kParts = 40;
  const double h = dt / kParts;
  std::array<double, 4> y{};
  const auto ahead = [&](const std::array<double, 4>& slope, double by) {
    std::array<double, 4> moved = y;
    for (size_t i = 0; i < 4; ++i) moved[i] += by * slope[i];
    return moved;
  };
  for (Eigen::Index k = 0; k < controls.rows(); ++k) {
    const RowMatrixXd::ConstRowXpr u = controls.row(k);
    for (int part = 0; part < kParts; ++part) {
      const auto k1 = rates(y, u), k2 = rates(ahead(k1, h / 2), u);
      const auto k3 = rates(ahead(k2, h / 2), u), k4 = rates(ahead(k3, h), u);
      for (size_t i = 0; i < 4; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    }
  }
  return y;
}

// data/control/pendulum.json: a rod of 1 kg, 0.05 by 1 m, that turns about its upper end.
std::array<double, 4> PendulumRates(const std::array<double, 4>& y,
                                    const RowMatrixXd::ConstRowXpr& u) {
  const double inertia = (0.05 * 0.05 + 1.0) / 12.0 + 0.25;
  return {y[1], (u[0] - 9.81 * 0.5 * std::sin(y[0]) - 0.02 * y[1]) / inertia, 0.0, 0.0};
}

// data/control/double_pendulum.json in the angles θ, φ of its rods from hanging, y = (θ, φ, θ̇, φ̇):
// kinetic energy ½ a θ̇² + b cos(θ − φ) θ̇ φ̇ + ½ c φ̇², torque u of shoulder and elbow.
std::array<double, 4> DoubleRates(const std::array<double, 4>& y,
                                  const RowMatrixXd::ConstRowXpr& u) {
  const double l = 0.5, m1 = 1.0, m2 = 0.5, g = 9.81, damping = 0.02;
  const double i1 = m1 * (0.05 * 0.05 + l * l) / 12.0, i2 = m2 * (0.05 * 0.05 + l * l) / 12.0;
  const double a = i1 + m1 * l * l / 4 + m2 * l * l, b = m2 * l * l / 2, c = i2 + m2 * l * l / 4;
  const double s = std::sin(y[0] - y[1]), co = std::cos(y[0] - y[1]);
  const double elbow = u[1] - damping * (y[3] - y[2]);
  const double f1 =
      u[0] - damping * y[2] - elbow - b * s * y[3] * y[3] - (m1 / 2 + m2) * g * l * std::sin(y[0]);
  const double f2 = elbow + b * s * y[2] * y[2] - m2 * g * l / 2 * std::sin(y[1]);
  const double det = a * c - b * b * co * co;
  return {y[2], y[3], (c * f1 - b * co * f2) / det, (a * f2 - b * co * f1) / det};
}

// A plan of a scene of data/control in one kind of steps, with its replay.
struct Planned {
  Planned(const std::string& name, const std::vector<std::string>& paths_, Stepping stepping,
          const std::vector<double>& bounds, const std::vector<CostTerm>& terms, int iterations)
      : paths(paths_) {
    std::string error;
    EXPECT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/" + name, &scene, &error)) << error;
    // What users get from the shipped scene.
    EXPECT_EQ(scene.simulation.stepping, Stepping::kEvent);
    scene.simulation.stepping = stepping;
    scene.simulation.joint_correction = JointCorrection::kProjection;
    RolloutFunction function;
    EXPECT_EQ(function.Create(scene, {}, paths, {}), "");
    EngineStep map(function);
    const auto m = static_cast<int>(paths.size());
    const Cost cost(map.num_states(), m, scene.simulation.dt, terms);
    const VectorX<double> bound =
        Eigen::Map<const VectorX<double>>(bounds.data(), static_cast<Eigen::Index>(bounds.size()));
    IlqrOptions options;
    options.max_iterations = iterations;
    result = SolveIlqr({&map, &cost, map.initial(), -bound, bound},
                       RowMatrixXd::Constant(function.num_steps(), m, 0.1), options);
    replay = ReplayByEvents(scene, paths, cost, result.plan.controls);
    nothing = ReplayByEvents(scene, paths, cost, 0.0 * result.plan.controls).cost;
  }

  Scene scene;
  std::vector<std::string> paths;
  IlqrResult result;
  Replay replay;
  double nothing = 0.0;
};

Planned Pendulum(Stepping stepping) {
  using Kind = CostTerm::Kind;
  return Planned("pendulum.json", {"joints/motor/effort"}, stepping, {2.5},
                 {{Kind::kControl, 0, 0, {0, 0}, 0.0, 0.05, false},
                  {Kind::kState, 2, 0, {0, 0}, kPi, 100.0, true},
                  {Kind::kState, 5, 0, {0, 0}, 0.0, 20.0, true}},
                 200);
}

// The plan by events ends where an integration in joint coordinates does; by fixed steps it does
// not, although the optimiser has converged.
TEST(Replay, TellsASwingUpThatFailsInTheMotion) {
  const Planned events = Pendulum(Stepping::kEvent), fixed = Pendulum(Stepping::kFixed);
  for (const Planned* plan : {&events, &fixed}) {
    EXPECT_EQ(plan->result.status, IlqrStatus::kConverged) << plan->result.message;
    ASSERT_TRUE(plan->replay.done) << plan->replay.message;
    const auto y = Integrate(PendulumRates, plan->result.plan.controls, plan->scene.simulation.dt);
    const auto last = plan->replay.states.row(plan->replay.states.rows() - 1);
    EXPECT_NEAR(last[2], y[0], 1e-6);
    EXPECT_NEAR(last[5], y[1], 5e-6);
  }
  // The integrator's error at the plan's step.
  EXPECT_NEAR(events.replay.cost, events.result.plan.cost, 1e-6 * events.result.plan.cost);
  EXPECT_FALSE(DiffersFromMotion(events.result.plan.cost, events.replay, events.nothing, 1.0));
  EXPECT_NEAR(events.replay.states(events.replay.states.rows() - 1, 2), kPi, 0.1);
  EXPECT_LT(fixed.result.plan.cost, 1.0);
  EXPECT_GT(fixed.replay.cost, 100.0);
  EXPECT_TRUE(DiffersFromMotion(fixed.result.plan.cost, fixed.replay, fixed.nothing, 1.0));
}

TEST(Replay, ADoublePendulumEndsWhereAnIntegrationInAnglesDoes) {
  using Kind = CostTerm::Kind;
  const Planned plan("double_pendulum.json", {"joints/shoulder/effort", "joints/elbow/effort"},
                     Stepping::kEvent, {4.0, 2.0},
                     {{Kind::kControl, 0, 0, {0, 0}, 0.0, 0.02, false},
                      {Kind::kControl, 1, 0, {0, 0}, 0.0, 0.02, false},
                      {Kind::kState, 2, 0, {0, 0}, kPi, 100.0, true},
                      {Kind::kState, 8, 0, {0, 0}, kPi, 100.0, true},
                      {Kind::kState, 5, 0, {0, 0}, 0.0, 10.0, true},
                      {Kind::kState, 11, 0, {0, 0}, 0.0, 10.0, true}},
                     60);
  ASSERT_TRUE(plan.replay.done) << plan.replay.message;
  const auto y = Integrate(DoubleRates, plan.result.plan.controls, plan.scene.simulation.dt);
  const auto last = plan.replay.states.row(plan.replay.states.rows() - 1);
  const double got[4] = {last[2], last[8], last[5], last[11]};
  // Of the replay: near the top errors of 1e-9 of the integrator grow a thousand times.
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(got[i], y[i], i < 2 ? 1e-6 : 1e-5) << i;
  EXPECT_FALSE(DiffersFromMotion(plan.result.plan.cost, plan.replay, plan.nothing, 1.0));
}

TEST(Replay, DiffersOnlyAboveBothShares) {
  Replay replay;
  EXPECT_TRUE(DiffersFromMotion(1.0, replay, 1.0, 1.0));  // it failed
  replay.done = true;
  const auto differs = [&](double cost, double nothing) {
    replay.cost = cost;
    return DiffersFromMotion(1.0, replay, nothing, 1.0);
  };
  EXPECT_FALSE(differs(1.049, 1.0));
  EXPECT_TRUE(differs(1.051, 1.0));
  EXPECT_FALSE(differs(1.051, 1e5));
  EXPECT_TRUE(differs(1.2, 1e5));
  EXPECT_FALSE(differs(0.1, 1.0));
  EXPECT_TRUE(differs(1.051, std::nan("")));
}

// Where nothing has to be done, or a plan costs nothing, shares of the costs are rounding.
TEST(Replay, AMotionThatMeetsItsTargetsHolds) {
  Replay replay;
  replay.done = true;
  replay.cost = 8e-26;
  EXPECT_FALSE(DiffersFromMotion(2e-28, replay, 8e-26, 50.0));
  replay.cost = 1.2e-10;
  EXPECT_FALSE(DiffersFromMotion(4e-19, replay, 0.0, 55.0));
  replay.cost = 1e-8;
  EXPECT_TRUE(DiffersFromMotion(4e-19, replay, 0.0, 55.0));
}

}  // namespace
}  // namespace tangible
