// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/ilqr.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "../support/random_matrix.h"
#include "../support/scenes.h"
#include "tangible/control/engine_step.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// x⁺ = A x + B u.
class Linear : public StepMap {
 public:
  Linear(MatrixX<double> a, MatrixX<double> b) : a_(std::move(a)), b_(std::move(b)) {}
  int num_states() const override { return static_cast<int>(a_.rows()); }
  int num_controls() const override { return static_cast<int>(b_.cols()); }
  bool Step(long, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string*) override {
    *next = a_ * x + b_ * u;
    return true;
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    *a = a_;
    *b = b_;
    return Step(k, x, u, next, error);
  }

 private:
  MatrixX<double> a_, b_;
};

// A pendulum with a torque, by a semi-implicit step: x = (angle from hanging, speed).
class Pendulum : public StepMap {
 public:
  int num_states() const override { return 2; }
  int num_controls() const override { return 1; }
  bool Step(long, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string*) override {
    next->resize(2);
    (*next)[1] = x[1] + kStep * (u[0] - 9.81 * std::sin(x[0]));
    (*next)[0] = x[0] + kStep * (*next)[1];
    return true;
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    const double by_angle = -kStep * 9.81 * std::cos(x[0]);
    a->resize(2, 2);
    *a << 1.0 + kStep * by_angle, kStep, by_angle, 1.0;
    b->resize(2, 1);
    *b << kStep * kStep, kStep;
    return Step(k, x, u, next, error);
  }
  static constexpr double kStep = 0.02;
};

Cost SwingUp() {
  return Cost(2, 1, Pendulum::kStep,
              {{CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, 0.1, false},
               {CostTerm::Kind::kState, 0, 0, {0, 0}, std::numbers::pi, 100.0, true},
               {CostTerm::Kind::kState, 1, 0, {0, 0}, 0.0, 100.0, true}});
}

ControlProblem ProblemOf(StepMap* map, const Cost* cost, VectorX<double> initial, double bound) {
  const VectorX<double> bounds = VectorX<double>::Constant(map->num_controls(), bound);
  return {map, cost, std::move(initial), -bounds, bounds};
}

// The Riccati recursion of min ½ Σ h (xᵀQx + uᵀRu) + ½ x_NᵀQ_N x_N, written out here.
TEST(Ilqr, OfALinearQuadraticProblemIsRiccatis) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  for (int run = 0; run < 10; ++run) {
    const int n = 2 + run % 4, m = 1 + run % 3, steps = 40;
    const double h = 0.1;
    const MatrixX<double> a =
        MatrixX<double>::Identity(n, n) + 0.1 * MatrixX<double>::NullaryExpr(n, n, draw);
    const MatrixX<double> b = 0.3 * MatrixX<double>::NullaryExpr(n, m, draw);
    std::vector<CostTerm> terms;
    VectorX<double> q(n), r(m), q_end(n);
    for (int i = 0; i < n; ++i) {
      q[i] = 0.5 + std::abs(draw());
      q_end[i] = 5.0 + std::abs(draw());
      terms.push_back({CostTerm::Kind::kState, i, 0, {0, 0}, 0.0, q[i], false});
      terms.push_back({CostTerm::Kind::kState, i, 0, {0, 0}, 0.0, q_end[i], true});
    }
    for (int i = 0; i < m; ++i) {
      r[i] = 0.2 + std::abs(draw());
      terms.push_back({CostTerm::Kind::kControl, i, 0, {0, 0}, 0.0, r[i], false});
    }
    MatrixX<double> p = q_end.asDiagonal();
    std::vector<MatrixX<double>> gains(steps);
    for (int k = steps - 1; k >= 0; --k) {
      const MatrixX<double> uu = h * MatrixX<double>(r.asDiagonal()) + b.transpose() * p * b;
      gains[k] = -uu.ldlt().solve(b.transpose() * p * a);
      p = h * MatrixX<double>(q.asDiagonal()) + a.transpose() * p * (a + b * gains[k]);
    }
    const VectorX<double> start = VectorX<double>::NullaryExpr(n, draw);
    Linear map(a, b);
    const Cost cost(n, m, h, terms);
    const ControlProblem problem = ProblemOf(&map, &cost, start, kInfinity);
    const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Constant(steps, m, 0.3), {});
    ASSERT_EQ(found.status, IlqrStatus::kConverged) << found.message;
    EXPECT_EQ(found.iterations.size(), 1u);
    EXPECT_NEAR(found.plan.cost, 0.5 * start.dot(p * start), 1e-10 * found.plan.cost);
    VectorX<double> x = start;
    for (int k = 0; k < steps; ++k) {
      const VectorX<double> u = gains[k] * x;
      EXPECT_LT((found.plan.controls.row(k).transpose() - u).norm(), 1e-10 * (1.0 + u.norm()));
      EXPECT_LT((found.plan.gains[k] - gains[k]).norm(), 1e-9 * (1.0 + gains[k].norm()));
      x = a * x + b * u;
    }
  }
}

// A cart is driven to its target by a force of little cost: the gradient's rounding, in proportion
// to the weight of the end, stays above its tolerance where no step decreases the cost any more.
TEST(Ilqr, ConvergesWhereOnlyRoundingIsLeft) {
  const double h = 0.05, mass = 2.0;
  MatrixX<double> a(2, 2), b(2, 1);
  a << 1.0, h, 0.0, 1.0;
  b << 0.5 * h * h / mass, h / mass;
  for (const double force : {1e-6, 1e-3, 1.0}) {
    for (const double end : {1.0, 100.0, 1e6}) {
      for (const int steps : {20, 200, 1000}) {
        Linear map(a, b);
        const Cost cost(2, 1, h,
                        {{CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, force, false},
                         {CostTerm::Kind::kState, 0, 0, {0, 0}, 1.0, end, true},
                         {CostTerm::Kind::kState, 1, 0, {0, 0}, 0.0, end, true}});
        const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
        const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(steps, 1), {});
        EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message << " " << steps;
        EXPECT_LE(found.iterations.size(), 4u) << force << " " << end << " " << steps;
      }
    }
  }
}

TEST(Ilqr, SwingsAPendulumUpWithinItsBounds) {
  Pendulum map;
  const Cost cost = SwingUp();
  for (const double bound : {4.0, 20.0}) {
    const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), bound);
    const IlqrResult found =
        SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), {.max_iterations = 500});
    EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
    EXPECT_NEAR(found.plan.states(150, 0), std::numbers::pi, 0.2);
    EXPECT_LE(found.plan.controls.cwiseAbs().maxCoeff(), bound);
    if (bound == 4.0) {
      EXPECT_EQ(found.plan.controls.cwiseAbs().maxCoeff(), bound);
    }
    for (size_t i = 1; i < found.iterations.size(); ++i) {
      EXPECT_LE(found.iterations[i].cost, found.iterations[i - 1].cost * (1.0 + 1e-12));
    }
  }
}

TEST(Ilqr, GradientIsThatOfTheCost) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
  const RowMatrixXd controls = testing::RandomMatrix(30, 1, 1);
  const auto value = [&](const RowMatrixXd& u) {
    VectorX<double> x = problem.initial, next;
    double sum = 0.0;
    for (long k = 0; k < u.rows(); ++k) {
      sum += cost.Value(x, u.row(k));
      map.Step(k, x, u.row(k), &next, nullptr);
      x = next;
    }
    return sum + cost.EndValue(x);
  };
  Plan plan{RowMatrixXd(31, 2), controls, {}, 0.0};
  plan.states.row(0) = problem.initial.transpose();
  for (long k = 0; k < 30; ++k) {
    VectorX<double> next;
    map.Step(k, plan.states.row(k), controls.row(k), &next, nullptr);
    plan.states.row(k + 1) = next.transpose();
  }
  RowMatrixXd costates;
  std::string error;
  const RowMatrixXd gradient = CostGradient(problem, plan, &costates, &error);
  for (const int k : {0, 7, 29}) {
    for (const double h : {1e-4, 1e-5}) {
      RowMatrixXd plus = controls, minus = controls;
      plus(k, 0) += h;
      minus(k, 0) -= h;
      EXPECT_NEAR(gradient(k, 0), (value(plus) - value(minus)) / (2.0 * h), 1e-6);
    }
  }
}

// With second order each of the last steps squares the gradient; without, it falls linearly.
TEST(Ilqr, SecondOrderConvergesQuadratically) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
  IlqrOptions options{.max_iterations = 500, .gradient_tolerance = 1e-10};
  const IlqrResult first = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  options.second_order = true;
  const IlqrResult second = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  ASSERT_EQ(second.status, IlqrStatus::kConverged) << second.message;
  EXPECT_NEAR(second.plan.cost, first.plan.cost, 1e-6 * first.plan.cost);
  std::vector<double> gradients;
  for (const IlqrIteration& iteration : second.iterations) gradients.push_back(iteration.gradient);
  gradients.push_back(second.gradient);
  // Of the last step that is well above rounding.
  double order = 0.0;
  for (size_t i = 2; i < gradients.size(); ++i) {
    if (gradients[i] > 1e-10 && gradients[i - 1] < 1e-2) {
      order = std::max(order, std::log(gradients[i] / gradients[i - 1]) /
                                  std::log(gradients[i - 1] / gradients[i - 2]));
    }
  }
  for (const double g : gradients) std::printf("%.1e ", g);
  std::printf("order %.2f; first order: %zu iterations\n", order, first.iterations.size());
  EXPECT_GT(order, 1.6);
}

// Secants find the same minimum in fewer iterations, at one linearisation each, and the last steps
// converge faster than linearly.
TEST(Ilqr, SecantsConvergeFasterAtNoFurtherLinearisation) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
  IlqrOptions options{.max_iterations = 500, .gradient_tolerance = 1e-10};
  const IlqrResult first = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  options.secants = true;
  const IlqrResult second = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  ASSERT_EQ(second.status, IlqrStatus::kConverged) << second.message;
  EXPECT_NEAR(second.plan.cost, first.plan.cost, 1e-9 * first.plan.cost);
  std::printf("%zu iterations, of first order %zu\n", second.iterations.size(),
              first.iterations.size());
  for (const IlqrIteration& iteration : second.iterations) std::printf("%.1e ", iteration.gradient);
  EXPECT_LT(3 * second.iterations.size(), 2 * first.iterations.size());
  EXPECT_LE(second.linearisations, static_cast<long>(second.iterations.size()) + 2);
}

// Where controls are at their bounds the same holds.
TEST(Ilqr, SecantsWithBoundsEndAtTheSameMinimum) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), 4.0);
  IlqrOptions options{.max_iterations = 1000};
  const IlqrResult first = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  options.secants = true;
  const IlqrResult second = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  ASSERT_EQ(second.status, IlqrStatus::kConverged) << second.message;
  std::printf("cost %.9f in %zu iterations, of first order %.9f in %zu\n", second.plan.cost,
              second.iterations.size(), first.plan.cost, first.iterations.size());
  EXPECT_LE(second.plan.cost, first.plan.cost * (1.0 + 1e-6));
}

// Second order is exact, and secants add nothing to it.
TEST(Ilqr, SecantsHaveNoEffectWithSecondOrder) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
  IlqrOptions options{.max_iterations = 10, .second_order = true};
  const IlqrResult exact = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  options.secants = true;
  const IlqrResult both = SolveIlqr(problem, RowMatrixXd::Constant(150, 1, 0.5), options);
  EXPECT_EQ(both.plan.controls, exact.plan.controls);
  EXPECT_EQ(both.rollouts, exact.rollouts);
}

TEST(Ilqr, MistakesAreNamed) {
  Pendulum map;
  const Cost cost = SwingUp();
  ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), 1.0);
  EXPECT_EQ(SolveIlqr(problem, RowMatrixXd(0, 1), {}).message,
            "horizon: expected at least one step, got none");
  problem.low[0] = 2.0;
  EXPECT_EQ(SolveIlqr(problem, RowMatrixXd::Zero(3, 1), {}).message,
            "bounds of control 0: expected low <= high, got 2.000000 and 1.000000");
  problem.low[0] = std::nan("");
  EXPECT_EQ(SolveIlqr(problem, RowMatrixXd::Zero(3, 1), {}).status, IlqrStatus::kFailed);
}

// x⁺ = x + u in the first steps, and nothing moves afterwards.
class FirstSteps : public Linear {
 public:
  explicit FirstSteps(long steps)
      : Linear(MatrixX<double>::Identity(1, 1), MatrixX<double>::Ones(1, 1)), steps_(steps) {}
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string*) override {
    *next = k < steps_ ? VectorX<double>(x + u) : x;
    return true;
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    Linear::Linearise(k, x, u, next, a, b, error);
    if (k >= steps_) b->setZero();
    return Step(k, x, u, next, error);
  }

 private:
  long steps_;
};

Cost EndAt(double target, int num_controls) {
  return Cost(1, num_controls, 0.1, {{CostTerm::Kind::kState, 0, 0, {0, 0}, target, 1.0, true}});
}

// Where a control momentarily moves nothing it stays as it was, and the others reach the target.
TEST(Ilqr, StepsInWhichAControlMovesNothingDoNotMatter) {
  FirstSteps map(3);
  const Cost cost = EndAt(1.0, 1);
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(1), kInfinity);
  for (const bool second_order : {false, true}) {
    const IlqrResult found =
        SolveIlqr(problem, RowMatrixXd::Constant(8, 1, 0.1), {.second_order = second_order});
    EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
    EXPECT_NEAR(found.plan.states(8, 0), 1.0, 1e-9);
    for (int k = 3; k < 8; ++k) EXPECT_EQ(found.plan.controls(k, 0), 0.1) << k;
  }
}

// Two controls that do the same: only their sum is determined where neither costs anything.
TEST(Ilqr, ControlsThatDoTheSameShareTheWork) {
  Linear map(MatrixX<double>::Identity(1, 1), MatrixX<double>::Ones(1, 2));
  const Cost cost = EndAt(1.0, 2);
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(1), kInfinity);
  const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(5, 2), {});
  EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
  EXPECT_NEAR(found.plan.states(5, 0), 1.0, 1e-9);
  EXPECT_NEAR(found.plan.controls(4, 0), found.plan.controls(4, 1), 1e-6);
}

TEST(Ilqr, WhereNothingMovesThereIsNothingToDo) {
  Linear map(MatrixX<double>::Identity(1, 1), MatrixX<double>::Zero(1, 1));
  const Cost cost = EndAt(1.0, 1);
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(1), kInfinity);
  const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(5, 1), {});
  EXPECT_EQ(found.status, IlqrStatus::kConverged);
  EXPECT_EQ(found.plan.cost, 0.5);
}

// A control without bounds has the range of what it takes to move anything: forces on a ship.
TEST(Ilqr, AControlWithoutBoundsMayHaveToBeLarge) {
  Linear map(MatrixX<double>::Identity(1, 1), MatrixX<double>::Constant(1, 1, 1e-9));
  const Cost cost = EndAt(1.0, 1);
  for (const double low : {-kInfinity, 0.0}) {
    ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(1), kInfinity);
    problem.low.setConstant(low);
    const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(5, 1), {});
    EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
    EXPECT_NEAR(found.plan.states(5, 0), 1.0, 1e-6);
  }
}

// What is left of the cost is rounding, of which no step is a decrease.
TEST(Ilqr, ATargetThatIsMetHasConverged) {
  Linear map(MatrixX<double>::Identity(1, 1), MatrixX<double>::Ones(1, 1));
  for (const double target : {1.0, 1000.0}) {
    const Cost cost = EndAt(target, 1);
    const double start = target * (1.0 + 1e-15);
    const ControlProblem problem =
        ProblemOf(&map, &cost, VectorX<double>::Constant(1, start), kInfinity);
    const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(5, 1), {});
    EXPECT_GT(found.plan.cost, 0.0);
    EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
    EXPECT_EQ(found.iterations.size(), 0u);
    EXPECT_EQ(found.gradient, 0.0);
  }
}

// The cost of an angle that wraps is largest half a turn from its target: a pendulum that hangs
// and shall stand has no gradient there. It gets up nevertheless.
TEST(Ilqr, LeavesTheMaximumOfAnAngleThatWraps) {
  Pendulum map;
  const Cost cost(2, 1, Pendulum::kStep,
                  {{CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, 0.01, false},
                   {CostTerm::Kind::kAngle, 0, 0, {0, 0}, std::numbers::pi, 100.0, true},
                   {CostTerm::Kind::kState, 1, 0, {0, 0}, 0.0, 10.0, true}});
  ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), 20.0);
  IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(100, 1), {.max_iterations = 500});
  EXPECT_TRUE(found.left_maximum);
  EXPECT_EQ(found.status, IlqrStatus::kConverged) << found.message;
  EXPECT_NEAR(std::abs(found.plan.states(100, 0)), std::numbers::pi, 0.1);
  // Controls at their upper bound are offset downwards.
  problem.high[0] = 0.0;
  found = SolveIlqr(problem, RowMatrixXd::Zero(100, 1), {.max_iterations = 500});
  EXPECT_TRUE(found.left_maximum);
  EXPECT_LT(found.plan.cost, 20.0);
  // Elsewhere the initial controls are used as they are.
  EXPECT_FALSE(
      SolveIlqr(problem, RowMatrixXd::Constant(100, 1, -1.0), {.max_iterations = 1}).left_maximum);
  // Controls that cannot move: the maximum is named.
  problem.low[0] = problem.high[0] = 0.0;
  found = SolveIlqr(problem, RowMatrixXd::Zero(100, 1), {});
  EXPECT_EQ(found.status, IlqrStatus::kConverged);
  EXPECT_NE(found.message.find("half a turn from its target"), std::string::npos) << found.message;
}

TEST(Ilqr, ASurrogateNeedsBounds) {
  Pendulum map;
  const Cost cost = SwingUp();
  const ControlProblem problem = ProblemOf(&map, &cost, VectorX<double>::Zero(2), kInfinity);
  IlqrOptions options;
  options.surrogate.samples = 2;
  const IlqrResult found = SolveIlqr(problem, RowMatrixXd::Zero(3, 1), options);
  EXPECT_EQ(found.status, IlqrStatus::kFailed);
  EXPECT_EQ(found.message,
            "bounds of control 0: expected finite ones, of whose range a surrogate's deviation is "
            "a share, got none");
}

}  // namespace
}  // namespace tangible
