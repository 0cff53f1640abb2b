// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/discretisation.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// A ball that falls as in continuous time, y = 10 + 3 t − 9.81 t² / 2, and its gravity to be
/// found.
FitProblem FreeFall() {
  FitProblem problem;
  problem.scene = MakeScene(kFallingBall);
  problem.scene.bodies[0].linear_damping = 0.0;
  problem.parameters = {Parameter("gravity/y", -9.0)};
  for (int k = 1; k <= 20; ++k) {
    const double t = 0.05 * k;
    problem.observations.push_back(
        {t, 0, -1, Coordinate::kY, 10.0 + 3.0 * t - 0.5 * 9.81 * t * t, 1e-3});
  }
  return problem;
}

FitResult FitOf(const FitProblem& problem) {
  RolloutResiduals residuals =
      MakeResiduals(problem.scene, problem.points, problem.parameters, problem.observations);
  return Fit(problem.options, &residuals, {});
}

TEST(DiscretisationTest, HalvingTheStepGivesTheBias) {
  const FitProblem problem = FreeFall();
  const FitResult result = FitOf(problem);
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const DiscretisationCheck check = CheckDiscretisation(InputOf(problem), {}, result);
  ASSERT_EQ(check.status, FitStatus::kConverged) << check.message;
  EXPECT_EQ(check.dt, 0.01);
  EXPECT_GT(check.rollouts, 0);
  EXPECT_EQ(check.difference[0], result.estimate[0] - check.estimate_half_step[0]);
  EXPECT_EQ(check.bias[0], 2.0 * check.difference[0]);
  EXPECT_EQ(check.extrapolated[0], result.estimate[0] - check.bias[0]);
  // Euler's fall is g (t² + t dt) / 2: least squares over 1 s find g too small by about 1.25 dt of
  // it, and what is left beyond first order is about (1.25 dt)² of it.
  const double error = result.estimate[0] + 9.81;
  EXPECT_NEAR(error, 1.25 * 0.01 * 9.81, 0.1 * error);
  EXPECT_LT(std::abs(check.extrapolated[0] + 9.81), 2.0 * 0.0125 * error);
}

// By events the ball's step is of fourth order; with a step of a second of its swing at a pin the
// bias is large enough to be seen.
TEST(DiscretisationTest, RungeKuttaIsOfFourthOrder) {
  EXPECT_EQ(OrderOf(Integrator::kSemiImplicitEuler), 1);
  EXPECT_EQ(OrderOf(Integrator::kTrapezoidal), 2);
  EXPECT_EQ(BiasFactor(1), 2.0);
  EXPECT_DOUBLE_EQ(BiasFactor(2), 4.0 / 3.0);
  EXPECT_DOUBLE_EQ(BiasFactor(4), 16.0 / 15.0);
  FitProblem problem;
  problem.scene = MakeScene(kPendulum);
  problem.scene.simulation.stepping = Stepping::kEvent;
  problem.scene.simulation.dt = 1e-3;
  problem.observations = Observe(problem.scene, 100, 0.0, 1);
  problem.parameters = {Parameter("gravity/y", -9.0)};
  problem.scene.simulation.dt = 0.1;
  const FitResult result = FitOf(problem);
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const DiscretisationCheck check = CheckDiscretisation(InputOf(problem), {}, result);
  ASSERT_EQ(check.status, FitStatus::kConverged) << check.message;
  EXPECT_EQ(check.order, 4);
  EXPECT_DOUBLE_EQ(check.bias[0], 16.0 / 15.0 * check.difference[0]);
  const double error = result.estimate[0] + 9.81;
  ASSERT_GT(std::abs(error), 1e-7);
  // What is left is of the next order; doubled, the difference would be off by nearly the error.
  EXPECT_LT(std::abs(check.extrapolated[0] + 9.81), 0.2 * std::abs(error));
}

TEST(DiscretisationTest, AProblemThatCannotBeSetUpIsSaid) {
  FitProblem problem = FreeFall();
  FitResult result;
  result.estimate = Eigen::VectorXd::Constant(1, -9.8);
  problem.parameters = {Parameter("bodies/none/mass", 1.0)};
  const DiscretisationCheck check = CheckDiscretisation(InputOf(problem), {}, result);
  EXPECT_EQ(check.status, FitStatus::kFailed);
  EXPECT_NE(check.message, "");
  EXPECT_EQ(check.bias.size(), 0);
}

}  // namespace
}  // namespace tangible
