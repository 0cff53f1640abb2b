// SPDX-License-Identifier: Apache-2.0
//
// The plants, the engine's model of them, what is learned from a recording, and the swing-up.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tangible/estimation/experiments/cartpole/cart_pole_study.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

const CartPoleState kMoving(0.1, 2.0, 0.5, -3.0);

double Energy(const CartPole& numbers, const CartPoleState& x) {
  const double arm = 0.5 * numbers.length;
  const Eigen::Vector2d centre(x[2] - arm * std::cos(x[1]) * x[3], -arm * std::sin(x[1]) * x[3]);
  return 0.5 * (numbers.cart_mass * x[2] * x[2] + numbers.pole_mass * centre.squaredNorm() +
                numbers.PoleInertia() * x[3] * x[3]) +
         numbers.pole_mass * 9.81 * arm * std::cos(x[1]);
}

VectorX<double> Force(double u) { return VectorX<double>::Constant(1, u); }

TEST(CartPolePlant, KeepsItsEnergyWithoutFrictionAndForce) {
  CartPole numbers;
  numbers.cart_damping = numbers.pole_damping = 0.0;
  const auto plant = MakeEquationPlant(numbers);
  EXPECT_NEAR(Energy(numbers, plant->Advance(kMoving, 0.0, 2.0)), Energy(numbers, kMoving), 1e-10);
}

TEST(CartPolePlant, AForceDoesWork) {
  // Over a short time the power is u v, less what friction takes.
  const CartPole numbers;
  const double h = 1e-6, u = 4.0;
  const double power = (Energy(numbers, MakeEquationPlant(numbers)->Advance(kMoving, u, h)) -
                        Energy(numbers, kMoving)) /
                       h;
  EXPECT_NEAR(power, u * 0.5 - numbers.cart_damping * 0.25 - numbers.pole_damping * 9.0, 1e-3);
}

TEST(CartPolePlant, MujocoMovesTheSameWay) {
  const CartPole numbers;
  const auto mujoco = MakeMujocoPlant(numbers);
  if (mujoco == nullptr) GTEST_SKIP() << "MuJoCo was not found when this was built";
  const CartPoleState equations = MakeEquationPlant(numbers)->Advance(kMoving, 4.0, 0.2);
  EXPECT_LT((mujoco->Advance(kMoving, 4.0, 0.2) - equations).norm(), 0.02);
}

TEST(CartPoleStep, IsTheEquationsStep) {
  const CartPole numbers;
  CartPoleStep step(numbers);
  VectorX<double> next;
  std::string error;
  ASSERT_TRUE(step.Step(0, kMoving, Force(4.0), &next, &error)) << error;
  EXPECT_LT((next - MakeEquationPlant(numbers)->Advance(kMoving, 4.0, kCartPoleStep)).norm(), 1e-6);
}

// Central differences of a step at two sizes.
void ExpectJacobians(StepMap* step, double tolerance) {
  VectorX<double> next, plus, minus;
  MatrixX<double> a, b;
  std::string error;
  const VectorX<double> x = kMoving;
  ASSERT_TRUE(step->Linearise(0, x, Force(4.0), &next, &a, &b, &error)) << error;
  for (const double h : {1e-4, 1e-5}) {
    for (int i = 0; i < 5; ++i) {
      VectorX<double> up = x, down = x;
      if (i < 4) {
        up[i] += h;
        down[i] -= h;
      }
      const double u = i < 4 ? 0.0 : h;
      ASSERT_TRUE(step->Step(0, up, Force(4.0 + u), &plus, &error)) << error;
      ASSERT_TRUE(step->Step(0, down, Force(4.0 - u), &minus, &error)) << error;
      const VectorX<double> column = i < 4 ? VectorX<double>(a.col(i)) : VectorX<double>(b.col(0));
      EXPECT_LT(((plus - minus) / (2.0 * h) - column).norm(), tolerance) << i << " at " << h;
    }
  }
}

TEST(CartPoleStep, HasExactJacobians) {
  CartPoleStep step{CartPole()};
  ExpectJacobians(&step, 1e-7);
}

TEST(CartPoleEstimate, FindsItsNumbersFromFourSeconds) {
  const CartPole truth;
  const auto plant = MakeEquationPlant(truth);
  for (const unsigned seed : {1U, 2U, 3U}) {
    const CartPoleEstimate estimate = EstimateCartPole(RecordRandomly(plant.get(), 200, seed));
    ASSERT_TRUE(estimate.ok) << estimate.fit.message;
    for (size_t i = 0; i < 5; ++i) {
      EXPECT_NEAR(NumbersOf(estimate.numbers)[i] / NumbersOf(truth)[i], 1.0, i < 3 ? 0.01 : 0.1)
          << estimate.names[i];
    }
  }
}

// The tangent space that plans move in is that of the joints, in world coordinates too: the same
// plan, of the same cost, with as many iterations. What differs is the time, of 12 states and of 4.
TEST(CartPoleStep, PlansInJointAndWorldCoordinatesAreTheSame) {
  const CartPole numbers;
  CartPoleStep joints(numbers);
  RolloutFunction function;
  ASSERT_EQ(function.Create(CartPoleScene(numbers), {}, {"joints/rail/effort"}, {}), "");
  EngineStep world(function);
  const Cost cost = SwingUpCost();
  // Of x, the angle, v and ω.
  const int rows[] = {0, 8, 3, 11};
  std::vector<CostTerm> terms = cost.terms();
  for (CostTerm& term : terms) {
    if (term.kind != CostTerm::Kind::kControl) term.index = rows[term.index];
  }
  const Cost world_cost(12, 1, kCartPoleStep, terms);
  const VectorX<double> bound = VectorX<double>::Constant(1, kCartPoleForce);
  State<double> state;
  Model<double> model;
  BuildModel(CartPoleScene(numbers), &model, &state);
  const CartPoleState start(0.0, 2.5, 0.0, 0.0);
  SetCartPoleState(numbers, start, &state);
  VectorX<double> world_start(12);
  for (int body = 0; body < 2; ++body) {
    for (int i = 0; i < 3; ++i) {
      world_start[6 * body + i] = state.pose[3 * body + i];
      world_start[6 * body + 3 + i] = state.twist[3 * body + i];
    }
  }
  const RowMatrixXd controls = RowMatrixXd::Constant(50, 1, 1.0);
  const IlqrOptions options{.max_iterations = 100, .gradient_tolerance = 1e-5};
  const IlqrResult one = SolveIlqr({&joints, &cost, start, -bound, bound}, controls, options);
  const IlqrResult other =
      SolveIlqr({&world, &world_cost, world_start, -bound, bound}, controls, options);
  EXPECT_EQ(one.status, IlqrStatus::kConverged) << one.message;
  EXPECT_EQ(other.status, IlqrStatus::kConverged) << other.message;
  std::printf("joint coordinates: cost %.9f, %zu iterations; world: %.9f, %zu\n", one.plan.cost,
              one.iterations.size(), other.plan.cost, other.iterations.size());
  EXPECT_EQ(one.iterations.size(), other.iterations.size());
  // Costs are quadratic in what the gradient's tolerance leaves open.
  EXPECT_NEAR(one.plan.cost, other.plan.cost, 1e-7 * one.plan.cost);
  EXPECT_LT((one.plan.controls - other.plan.controls).cwiseAbs().maxCoeff(), 0.01);
}

TEST(SwingUp, StandsUprightWithLearnedNumbers) {
  const auto plant = MakeEquationPlant(CartPole());
  const CartPoleEstimate estimate = EstimateCartPole(RecordRandomly(plant.get(), 100, 5));
  ASSERT_TRUE(estimate.ok) << estimate.fit.message;
  CartPoleStep step(estimate.numbers);
  const SwingUp run = RunSwingUp(&step, plant.get(), {0.0, std::numbers::pi, 0.0, 0.0},
                                 {.steps = 200, .horizon = 50, .iterations = 1});
  EXPECT_TRUE(run.success);
  EXPECT_GT(run.reward, 0.75);
}

TEST(Perceptron, HasTheGradientOfItsLoss) {
  PerceptronOptions options;
  options.width = 7;
  Perceptron perceptron(3, 2, options);
  std::mt19937_64 random = Generator(1, 0);
  Eigen::MatrixXd inputs(3, 5), targets(2, 5);
  for (double& value : inputs.reshaped()) value = Normal(&random);
  for (double& value : targets.reshaped()) value = Normal(&random);
  Eigen::VectorXd gradient, ignored;
  perceptron.Loss(inputs, targets, &gradient);
  for (const double h : {1e-4, 1e-5}) {
    for (Eigen::Index i = 0; i < gradient.size(); ++i) {
      const double weight = perceptron.weights()[i];
      perceptron.weights()[i] = weight + h;
      const double plus = perceptron.Loss(inputs, targets, &ignored);
      perceptron.weights()[i] = weight - h;
      const double minus = perceptron.Loss(inputs, targets, &ignored);
      perceptron.weights()[i] = weight;
      EXPECT_NEAR((plus - minus) / (2.0 * h), gradient[i], 1e-7) << i;
    }
  }
}

TEST(Perceptron, LearnsASine) {
  Eigen::MatrixXd inputs(1, 100), targets(1, 100);
  for (int i = 0; i < 100; ++i) {
    inputs(0, i) = -2.0 + 0.04 * i;
    targets(0, i) = std::sin(2.0 * inputs(0, i));
  }
  Perceptron perceptron(1, 1, PerceptronOptions());
  perceptron.Train(inputs, targets);
  EXPECT_LT((perceptron.Evaluate(inputs) - targets).cwiseAbs().maxCoeff(), 0.05);
}

TEST(LearnedStep, HasExactJacobians) {
  const auto plant = MakeEquationPlant(CartPole());
  LearnedStepOptions options;
  options.perceptron.updates = 200;
  options.members = 2;
  LearnedStep step(RecordRandomly(plant.get(), 60, 1), options);
  ExpectJacobians(&step, 1e-5);
}

TEST(LearnedStep, SmoothingIsExactForQuadratics) {
  CartPoleRecording recording;
  recording.positions.resize(9, 2);
  for (int k = 0; k < 9; ++k) {
    const double t = k * kCartPoleStep;
    recording.positions.row(k) << 1.0 + 2.0 * t + 3.0 * t * t, -4.0 * t * t;
  }
  const RowMatrixXd states = SmoothedStates(recording, 3);
  EXPECT_TRUE(std::isnan(states(2, 0)));
  const double t = 4 * kCartPoleStep;
  EXPECT_LT((states.row(4) -
             Eigen::RowVector4d(1.0 + 2.0 * t + 3.0 * t * t, -4.0 * t * t, 2.0 + 6.0 * t, -8.0 * t))
                .norm(),
            1e-12);
}

TEST(CartPoleStudy, QuartilesOfFewAndInfiniteValues) {
  const Quartiles quartiles = QuartilesOf({3.0, 1.0, 2.0, HUGE_VAL, HUGE_VAL});
  EXPECT_EQ(quartiles.low, 2.0);
  EXPECT_EQ(quartiles.median, 3.0);
  EXPECT_EQ(quartiles.high, HUGE_VAL);
  EXPECT_EQ(QuartilesOf({1.0, 2.0}).median, 1.5);
}

}  // namespace
}  // namespace tangible
