// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/minimise.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(RobustCostTest, IsQuadraticWithinTheBoundAndLinearBeyond) {
  const Eigen::Vector3d r(0.5, -2.0, 10.0);
  EXPECT_DOUBLE_EQ(RobustCost(r, 0.0), 0.5 * (0.25 + 4.0 + 100.0));
  // 2 b |r| − b² beyond b = 2.
  EXPECT_DOUBLE_EQ(RobustCost(r, 2.0), 0.5 * (0.25 + 4.0 + 2.0 * 2.0 * 10.0 - 4.0));
}

TEST(RobustGradientTest, IsTheDerivativeOfTheCost) {
  const RowMatrixXd jacobian = RowMatrixXd::Random(20, 3);
  const Eigen::VectorXd r = 4.0 * Eigen::VectorXd::Random(20);
  ASSERT_GT(r.cwiseAbs().maxCoeff(), 1.5);
  for (const double huber : {0.0, 1.5}) {
    const Eigen::VectorXd gradient = RobustGradient(r, jacobian, huber);
    for (int k = 0; k < 3; ++k) {
      const double h = 1e-6;
      const double high = RobustCost(r + h * jacobian.col(k), huber);
      const double low = RobustCost(r - h * jacobian.col(k), huber);
      // Rounding of costs of order 100 over h.
      EXPECT_NEAR((high - low) / (2.0 * h), gradient[k], 1e-7);
    }
  }
}

Minimum MinimiseFrom(const std::vector<FitParameter>& parameters, const FitOptions& options,
                     const std::vector<Observation>& observations, int* reports) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
  return Minimise(
      options, residuals.scene().Initial(), [] { return 1.0; },
      [reports](int iteration, const FitIteration&) { EXPECT_EQ(iteration, (*reports)++); },
      &residuals);
}

TEST(MinimiseTest, EndsAtTheMinimumAndTellsEveryIteration) {
  int reports = 0;
  const Minimum minimum = MinimiseFrom({Parameter("gravity/y", -5.0)}, {},
                                       Observe(MakeScene(kFallingBall), 5, 0.01, 1), &reports);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_EQ(reports, static_cast<int>(minimum.iterations.size()));
  EXPECT_EQ(minimum.iterations.front().parameters, std::vector<double>{-5.0});
  EXPECT_EQ(minimum.iterations.back().cost, minimum.cost);
  EXPECT_EQ(minimum.iterations.back().parameters[0], minimum.parameters[0]);
  EXPECT_EQ(RobustCost(minimum.residuals, 0.0), minimum.cost);
  // Jᵀ r = 0, to rounding of its terms.
  const double gradient = minimum.jacobian.col(0).dot(minimum.residuals);
  const double terms = minimum.jacobian.col(0).cwiseAbs().dot(minimum.residuals.cwiseAbs());
  EXPECT_LT(std::abs(gradient), 1e-10 * terms);
}

TEST(MinimiseTest, AParameterThatIsPushedOutStaysAtItsBound) {
  FitParameter damping = Parameter("bodies/ball/linear_damping", 0.5);
  damping.lower = 0.4;  // the truth is 0.3
  int reports = 0;
  const Minimum minimum = MinimiseFrom({damping, Parameter("gravity/y", -8.0)}, {},
                                       Observe(MakeScene(kFallingBall), 5, 0.0, 1), &reports);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_DOUBLE_EQ(minimum.parameters[0], 0.4);
  EXPECT_EQ(minimum.jacobian.col(0).cwiseAbs().maxCoeff(), 0.0);  // it is held
  EXPECT_LT(std::abs(minimum.jacobian.col(1).dot(minimum.residuals)),
            1e-8 * minimum.jacobian.col(1).cwiseAbs().dot(minimum.residuals.cwiseAbs()));
  damping.lower = 0.35;  // the cost falls beyond the bound
  reports = 0;
  const Minimum wider = MinimiseFrom({damping, Parameter("gravity/y", -8.0)}, {},
                                     Observe(MakeScene(kFallingBall), 5, 0.0, 1), &reports);
  EXPECT_LT(wider.cost, 0.5 * minimum.cost);
}

TEST(MinimiseTest, TheLimitOfIterationsIsKept) {
  FitOptions options;
  options.max_iterations = 2;
  int reports = 0;
  const Minimum minimum =
      MinimiseFrom({Parameter("gravity/y", -5.0), Parameter("bodies/ball/linear_damping", 3.0)},
                   options, Observe(MakeScene(kFallingBall), 5, 0.01, 1), &reports);
  EXPECT_EQ(minimum.status, FitStatus::kNotConverged);
  EXPECT_EQ(minimum.iterations.size(), 3u);
}

TEST(MinimiseTest, AStartThatCannotBeRunFails) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("bodies/ball/mass", 1.0), Parameter("gravity/y", -9.0)},
                    Observe(scene, 10, 0.0, 1));
  Eigen::VectorXd start(2);
  start << 1.0, 1e308;
  const Minimum minimum = Minimise(
      {}, start, [] { return 0.0; }, [](int, const FitIteration&) {}, &residuals);
  EXPECT_EQ(minimum.status, FitStatus::kFailed);
  EXPECT_EQ(minimum.message.rfind("the run at the initial values fails: ", 0), 0u)
      << minimum.message;
}

TEST(SetInternalBoundsTest, MovesTheStartWithinTheBounds) {
  FitParameter gravity = Parameter("gravity/y", -9.0);
  gravity.lower = -10.0;
  gravity.upper = -8.0;
  const Scene scene = MakeScene(kFallingBall);
  const RolloutResiduals residuals =
      MakeResiduals(scene, {}, {gravity}, Observe(scene, 10, 0.0, 1));
  Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 1e9);
  ceres::Problem problem;
  problem.AddParameterBlock(x.data(), 1);
  SetInternalBounds(residuals.scene(), &problem, &x);
  EXPECT_NEAR(ToParameters(residuals.entries(), x)[0], -8.0, 1e-12);
  EXPECT_EQ(problem.GetParameterUpperBound(x.data(), 0), x[0]);
  EXPECT_LT(problem.GetParameterLowerBound(x.data(), 0), x[0]);
}

}  // namespace
}  // namespace tangible
