// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/windows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// A pendulum over five periods, of which the plain fit loses count from too small a gravity.
struct PendulumFit {
  Scene scene = MakeScene(kPendulum);
  std::vector<FitParameter> parameters = {Parameter("gravity/y", -2.5),
                                          Parameter("joints/pin/angle", 0.7)};
  PendulumFit() {
    scene.simulation.duration = 8.0;
    parameters[0].lower = -20.0;
    parameters[0].upper = -1.0;
  }
  FitResult Run(FitApproach approach) const {
    RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, Observe(scene, 4, 0.002, 3));
    FitOptions options;
    options.approach = approach;
    options.profile_pass = ProfilePass::kSkip;  // which would find the other minimum
    return Fit(options, &residuals, {});
  }
};

TEST(WindowsTest, AWindowHasTheFirstObservationsAndAllParameters) {
  const PendulumFit pendulum;
  RolloutResiduals residuals =
      MakeResiduals(pendulum.scene, {}, pendulum.parameters, Observe(pendulum.scene, 4, 0.0, 1));
  const std::unique_ptr<LeastSquaresProblem> window = residuals.Window(0.25);
  ASSERT_NE(window, nullptr);
  EXPECT_EQ(window->entries().size(), 2U);
  // From 0 to 2 s each 0.04 s: 51 times, three coordinates.
  ASSERT_EQ(window->num_rows(0), 51 * 3);
  const Eigen::VectorXd p = InitialOf(residuals.entries());
  BlockEvaluation part;
  BlockEvaluation whole;
  ASSERT_TRUE(
      window->EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &part));
  ASSERT_TRUE(
      residuals.EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &whole));
  EXPECT_EQ(part.residuals, whole.residuals.head(51 * 3));
  EXPECT_EQ(part.jacobian, whole.jacobian.topRows(51 * 3));
}

TEST(WindowsTest, LeadWhereThePlainFitEndsElsewhere) {
  const PendulumFit pendulum;
  const FitResult plain = pendulum.Run(FitApproach::kPlain);
  EXPECT_GT(plain.uncertainty.reduced_chi_square, 100.0);
  for (const FitApproach approach : {FitApproach::kAuto, FitApproach::kWindows}) {
    const FitResult fit = pendulum.Run(approach);
    ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    EXPECT_NEAR(fit.estimate[0], -9.81, 5.0 * fit.uncertainty.standard_deviation[0]);
    EXPECT_NEAR(fit.estimate[1], 1.0, 5.0 * fit.uncertainty.standard_deviation[1]);
    EXPECT_EQ(fit.starts[0].approach, "windows");
    EXPECT_GT(fit.starts[0].approach_iterations, 0);
    EXPECT_NE(fit.message.find("growing windows led"), std::string::npos) << fit.message;
    // The plain fit, which makes no progress at first, is not made to its end.
    EXPECT_TRUE(std::isnan(fit.starts[0].plain_cost));
    EXPECT_LT(fit.rollouts, plain.rollouts + 400);
  }
}

// One segment is the plain fit, which ends elsewhere.
TEST(WindowsTest, LeadWhereSegmentsAndThePlainFitEndElsewhere) {
  const FitResult fit = PendulumFit().Run(FitApproach::kSegments);
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], -9.81, 5.0 * fit.uncertainty.standard_deviation[0]);
  EXPECT_EQ(fit.starts[0].approach, "windows");
  EXPECT_EQ(fit.starts[0].tried, "segments");
  EXPECT_GT(fit.starts[0].plain_cost, 100.0 * fit.final_cost);
  EXPECT_EQ(fit.starts[0].tried_cost, fit.starts[0].plain_cost);
}

TEST(WindowsTest, AreNotGrownWhereThePlainFitExplainsTheObservations) {
  PendulumFit pendulum;
  pendulum.parameters[0].initial = -9.7;
  pendulum.parameters[1].initial = 1.02;
  const FitResult plain = pendulum.Run(FitApproach::kPlain);
  const FitResult fit = pendulum.Run(FitApproach::kAuto);
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_EQ(fit.starts[0].approach, "plain");
  EXPECT_EQ(fit.estimate, plain.estimate);
  EXPECT_EQ(fit.starts[0].plain_cost, fit.final_cost);
}

// What neither explains ends as well as the plain fit: an observed body that falls upwards.
TEST(WindowsTest, NeverEndWorseThanThePlainFit) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations = Observe(scene, 2, 0.001, 1);
  for (Observation& observation : observations) {
    observation.value += 0.3 * std::sin(9.0 * observation.time);
  }
  const std::vector<FitParameter> parameters = {Parameter("bodies/ball/linear_damping", 0.1)};
  std::vector<double> costs;
  for (const FitApproach approach :
       {FitApproach::kPlain, FitApproach::kAuto, FitApproach::kWindows}) {
    RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
    FitOptions options;
    options.approach = approach;
    const FitResult fit = Fit(options, &residuals, {});
    EXPECT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    // Where both end at the same minimum, the approach that was made first is said to lead to it.
    EXPECT_EQ(fit.starts[0].approach, approach == FitApproach::kWindows ? "windows" : "plain");
    costs.push_back(fit.final_cost);
  }
  EXPECT_LE(costs[1], costs[0]);
  EXPECT_LE(costs[2], costs[0] * (1.0 + 1e-9));
}

}  // namespace
}  // namespace tangible
