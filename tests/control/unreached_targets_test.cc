// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/unreached_targets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

using Kind = CostTerm::Kind;

// The targets that motions of the struck ball's scene under a held effort do not reach.
class StruckBall {
 public:
  StruckBall() {
    Scene scene;
    std::string error;
    EXPECT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json", &scene, &error));
    EXPECT_EQ(function_.Create(scene, {}, {"joints/slider/effort"}, {}), "");
    const std::vector<std::string> names = OutputNames(function_.structure());
    ball_ = static_cast<int>(std::find(names.begin(), names.end(), "ball/x") - names.begin());
  }

  int hammer() const { return 0; }
  int ball() const { return ball_; }

  UnreachedTargets Find(const std::vector<CostTerm>& terms, double effort) {
    EngineStep map(function_);
    const Cost cost(map.num_states(), 1, function_.scene().simulation.dt, terms);
    const VectorX<double> bound = VectorX<double>::Constant(1, 30.0);
    const ControlProblem problem{&map, &cost, map.initial(), -bound, bound};
    Plan plan;
    plan.controls = RowMatrixXd::Constant(function_.num_steps(), 1, effort);
    plan.states.resize(plan.controls.rows() + 1, map.num_states());
    plan.states.row(0) = map.initial().transpose();
    VectorX<double> next;
    std::string error;
    for (long k = 0; k < plan.controls.rows(); ++k) {
      EXPECT_TRUE(map.Step(k, plan.states.row(k), plan.controls.row(k), &next, &error)) << error;
      plan.states.row(k + 1) = next.transpose();
    }
    return FindUnreachedTargets(problem, plan);
  }

 private:
  RolloutFunction function_;
  int ball_ = 0;
};

// 6.5 N strike the ball, 0.5 N do not: the ball's place is then beyond the controls, as an end and
// over the steps alike. The effort's own term is no target.
TEST(UnreachedTargets, OfABallThatIsMissed) {
  StruckBall scene;
  for (const bool at_end : {true, false}) {
    const std::vector<CostTerm> terms = {
        {Kind::kControl, 0, 0, {0, 0}, 0.0, 1e-3, false},
        {Kind::kPoint, scene.ball(), 0, {0, 0}, 1.8, 100.0, at_end},
        {Kind::kPoint, scene.ball(), 1, {0, 0}, 0.4, 100.0, at_end}};
    const UnreachedTargets missed = scene.Find(terms, 0.5), struck = scene.Find(terms, 6.5);
    EXPECT_TRUE(missed.all);
    EXPECT_EQ(missed.terms, (std::vector<int>{1, 2}));
    EXPECT_FALSE(struck.all);
    EXPECT_TRUE(struck.terms.empty());
  }
}

// A term of the hammer beside that of the ball: the second alone is beyond the controls, and not
// all is; the height of the hammer, which the rail keeps, is met, or is not.
TEST(UnreachedTargets, NamesOnlyThoseWithoutEffect) {
  StruckBall scene;
  std::vector<CostTerm> terms = {{Kind::kState, scene.hammer(), 0, {0, 0}, 1.0, 1.0, true},
                                 {Kind::kState, scene.ball(), 0, {0, 0}, 1.8, 100.0, true},
                                 {Kind::kState, scene.hammer() + 1, 0, {0, 0}, 0.9, 1.0, true}};
  const UnreachedTargets one = scene.Find(terms, 0.5);
  EXPECT_FALSE(one.all);
  EXPECT_EQ(one.terms, std::vector<int>{1});
  terms[2].target = 2.0;
  EXPECT_EQ(scene.Find(terms, 0.5).terms, (std::vector<int>{1, 2}));
  // A term of weight 0 asks for nothing.
  terms[1].weight = terms[2].weight = 0.0;
  EXPECT_TRUE(scene.Find(terms, 0.5).terms.empty());
}

// A cart that goes by its control, x⁺ = min(x + u, 1), and no further than its stop.
class CartToAStop : public StepMap {
 public:
  int num_states() const override { return 1; }
  int num_controls() const override { return 1; }
  bool Step(long, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string*) override {
    *next = (x + u).cwiseMin(1.0);
    return true;
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    const double moves = x[0] + u[0] < 1.0 ? 1.0 : 0.0;
    *a = MatrixX<double>::Constant(1, 1, moves);
    *b = *a;
    return Step(k, x, u, next, error);
  }
};

// A target behind the stop: pushed against it the cart has no derivative, but stays back with less
// effort. Pushed far beyond it, it has none either with 1 % less.
TEST(UnreachedTargets, AStopIsReachedFromOneSide) {
  CartToAStop map;
  const Cost cost(1, 1, 0.1, {{Kind::kState, 0, 0, {0, 0}, 2.0, 1.0, true}});
  const VectorX<double> none = VectorX<double>::Zero(1), bound = VectorX<double>::Constant(1, 3.0);
  for (const double u : {0.5, 3.0}) {
    Plan plan;
    plan.controls = RowMatrixXd::Constant(2, 1, u);
    plan.states = RowMatrixXd::Zero(3, 1);
    plan.states(1, 0) = std::min(u, 1.0);
    plan.states(2, 0) = 1.0;
    const UnreachedTargets found = FindUnreachedTargets({&map, &cost, none, -bound, bound}, plan);
    EXPECT_EQ(found.all, u == 3.0);
    EXPECT_EQ(found.one_sided, u == 3.0 ? std::vector<int>{} : std::vector<int>{0});
  }
}

// Half a turn from its target the cost of an angle that wraps has no gradient, but controls do
// turn the rod.
TEST(UnreachedTargets, AnAngleAtTheMaximumOfItsCostIsReached) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/pendulum.json", &scene, &error));
  scene.simulation.duration = 0.1;
  RolloutFunction function;
  ASSERT_EQ(function.Create(scene, {}, {"joints/motor/effort"}, {}), "");
  EngineStep map(function);
  const Cost cost(6, 1, scene.simulation.dt,
                  {{Kind::kAngle, 2, 0, {0, 0}, std::numbers::pi, 1.0, true}});
  const VectorX<double> bound = VectorX<double>::Constant(1, 2.5);
  Plan plan;
  plan.controls = RowMatrixXd::Zero(function.num_steps(), 1);
  plan.states = map.initial().transpose().replicate(plan.controls.rows() + 1, 1);
  const UnreachedTargets found =
      FindUnreachedTargets({&map, &cost, map.initial(), -bound, bound}, plan);
  EXPECT_FALSE(found.all);
  EXPECT_TRUE(found.terms.empty());
}

}  // namespace
}  // namespace tangible
