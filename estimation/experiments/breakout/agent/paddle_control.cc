// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/paddle_control.h"

#include <algorithm>
#include <cmath>

#include "tangible/control/ilqr.h"
#include "tangible/estimation/experiments/breakout/agent/tolerances.h"

namespace tangible {
namespace {

constexpr int kComparedSteps = 5;  // 3⁵ sequences
constexpr int kLongestPlan = 12;   // steps
constexpr int kIterations = 4;     // of iLQR
constexpr double kPressed = 0.5;   // a planned press beyond it becomes one
// Costs of the comparison, pixels²: outside of the interval, of a press, and of a pixel a frame as
// the ball is met.
constexpr double kOutside = 25.0, kPress = 0.05, kMoving = 0.1;
// The factor by which each later step reduces the uncertainty of a step, because it can correct it.
constexpr double kUncertaintyLeft = 0.4;
// Weights of a plan: of the distance at the end, of that on the way, and of a press.
constexpr double kEndWeight = 1.0, kWayWeight = 0.05, kPressWeight = 20.0;

CostTerm Term(CostTerm::Kind kind, int index, double target, double weight, bool at_end) {
  CostTerm term;
  term.kind = kind;
  term.index = index;
  term.target = target;
  term.weight = weight;
  term.at_end = at_end;
  return term;
}

}  // namespace

int PaddleControl::Direction(const PaddleState& state, const PaddleGoal& goal) {
  const int frames = std::max(1, static_cast<int>(std::lround(goal.frames)));
  return frames <= kComparedSteps * kFrameSkip ? Compare(state, goal, frames).direction
                                               : Plan(state, goal);
}

int PaddleControl::Plan(const PaddleState& state, const PaddleGoal& goal) {
  // A paddle that waits at its place needs no plan.
  if (std::abs(state.x - goal.x) < kAtPlace && std::abs(state.v) < kPaddleRests) return 0;
  ++num_plans_;
  const int steps = std::min(kLongestPlan, static_cast<int>(std::ceil(goal.frames / kFrameSkip)));
  using Kind = CostTerm::Kind;
  const Cost cost(2, 1, 1.0,
                  {Term(Kind::kState, 0, goal.x, kWayWeight, false),
                   Term(Kind::kControl, 0, 0.0, kPressWeight, false),
                   Term(Kind::kState, 0, goal.x, kEndWeight, true)});
  PaddleStep step(*model_);
  const VectorX<double> bound = VectorX<double>::Ones(1);
  IlqrOptions options;
  options.max_iterations = kIterations;
  const IlqrResult result =
      SolveIlqr({&step, &cost, Eigen::Vector2d(state.x, state.v), -bound, bound, 0},
                RowMatrixXd::Zero(steps, 1), options);
  if (result.status == IlqrStatus::kFailed) return 0;
  const double press = result.plan.controls(0, 0);
  return press > kPressed ? 1 : press < -kPressed ? -1 : 0;
}

PaddleControl::Best PaddleControl::Compare(const PaddleState& state, const PaddleGoal& goal,
                                           int frames) const {
  Best best{HUGE_VAL, 0};
  // No press comes first, so that it is chosen among equal costs.
  for (const int direction : {0, -1, 1}) {
    const PaddleState after = model_->After(state, direction, std::min(frames, kFrameSkip));
    const int later = (frames - 1) / kFrameSkip;  // steps
    double cost = kPress * std::abs(direction) +
                  std::pow(kUncertaintyLeft, later) * model_->Variance(state, direction);
    if (frames > kFrameSkip) {
      cost += Compare(after, goal, frames - kFrameSkip).cost;
    } else {
      const double off = std::max({0.0, goal.low - after.x, after.x - goal.high});
      const double distance = after.x - goal.x;
      cost += distance * distance + kOutside * off * off + kMoving * std::abs(after.v);
    }
    if (cost < best.cost) best = {cost, direction};
  }
  return best;
}

}  // namespace tangible
