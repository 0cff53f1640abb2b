// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/shooting.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(ShootingTest, AWholeRunCutInPiecesIsTheSameRun) {
  const Scene scene = MakeScene(kSmallChain);
  FitParameter mass = Parameter("bodies/link*/mass", 0.9);
  RolloutResiduals residuals = MakeResiduals(scene, {}, {mass}, Observe(scene, 3, 0.001, 1));
  ShootingResiduals shooting(5, &residuals);
  const Eigen::VectorXd p = residuals.scene().Initial();
  Eigen::VectorXd states;
  ASSERT_TRUE(shooting.StatesOfRun(p, &states));
  ASSERT_EQ(states.size(), 4 * 6 * 4);
  Eigen::VectorXd x(1 + states.size());
  x << p, states;
  Eigen::VectorXd pieces;
  Eigen::VectorXd whole;
  ASSERT_TRUE(shooting.Evaluate(x, &pieces, nullptr));
  ASSERT_TRUE(
      residuals.Evaluate(residuals.scene().Initial(), GradientMethod::kTangent, &whole, nullptr));
  // A segment starts without the last step's modes as a guess: equal to the solver's rounding, in
  // sigmas of 1 mm.
  EXPECT_LT((pieces.head(whole.size()) - whole).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT(pieces.segment(whole.size(), 4 * 24).cwiseAbs().maxCoeff(), 1e-11);
  // The joints hold, and their rates but for a step's change of their directions: the twist is on
  // the joints of the step's start.
  EXPECT_LT(pieces.tail(4 * 3 * 6).cwiseAbs().maxCoeff(), 2.0 * scene.simulation.dt);
}

TEST(ShootingTest, DerivativesAreThoseOfDifferences) {
  Scene scene = MakeScene(kSmallChain);
  scene.bodies[1].motion = Motion::kMoving;
  FitParameter mass = Parameter("bodies/link*/mass", 0.9);
  mass.lower = 0.1;
  std::vector<Observation> observations = Observe(scene, 4, 0.01, 1);
  observations[30].time += 0.4 * scene.simulation.dt;
  RolloutResiduals residuals = MakeResiduals(
      scene, {}, {mass, Parameter("gravity/y", -9.0), Parameter("joints/j1/rate", 0.1)},
      observations);
  ShootingResiduals shooting(3, &residuals);
  shooting.SetJumpSigma(0.01);
  shooting.SetJointSigma(0.01);
  const Eigen::VectorXd p = residuals.scene().Initial();
  Eigen::VectorXd states;
  ASSERT_TRUE(shooting.StatesOfRun(p, &states));
  Eigen::VectorXd x(p.size() + states.size());
  x << p, states;
  Eigen::VectorXd r;
  RowMatrixXd jacobian;
  ASSERT_TRUE(shooting.Evaluate(x, &r, &jacobian));
  const double h = 1e-6;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Eigen::VectorXd low = x;
    Eigen::VectorXd high = x;
    low[k] -= h;
    high[k] += h;
    Eigen::VectorXd r_low;
    Eigen::VectorXd r_high;
    ASSERT_TRUE(shooting.Evaluate(low, &r_low, nullptr));
    ASSERT_TRUE(shooting.Evaluate(high, &r_high, nullptr));
    const Eigen::VectorXd difference = (r_high - r_low) / (2.0 * h);
    // Rounding of residuals of order 100 over 2 h, and the second-order error.
    EXPECT_LT((jacobian.col(k) - difference).cwiseAbs().maxCoeff(),
              1e-5 * jacobian.col(k).cwiseAbs().maxCoeff() + 1e-6)
        << k;
    EXPECT_GT(jacobian.col(k).norm(), 0.0) << k;
  }
}

// Ten times of observations make five segments; of one body's states, 6 numbers at each cut, there
// are at most 201.
TEST(ShootingTest, TakesNoMoreSegmentsThanObservationsSupport) {
  Scene scene = MakeScene(kPendulum);
  scene.simulation.duration = 0.9;
  const std::vector<FitParameter> parameters = {Parameter("joints/pin/angle", 0.9)};
  RolloutResiduals few = MakeResiduals(scene, {}, parameters, Observe(scene, 10, 0.002, 3));
  EXPECT_EQ(MostSegments(few), 5);
  EXPECT_EQ(ShootingResiduals(1000, &few).num_segments(), 5);
  EXPECT_EQ(ShootingResiduals(3, &few).num_segments(), 3);
  FitOptions options;
  options.approach = FitApproach::kSegments;
  options.segments = 1000;
  const FitResult fit = Fit(options, &few, {});
  EXPECT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_EQ(fit.starts[0].message.find("only 5 of 1000 segments: "), 0u) << fit.starts[0].message;
  options.segments = 5;
  EXPECT_EQ(Fit(options, &few, {}).starts[0].message, "");
  scene.simulation.duration = 9.0;
  EXPECT_EQ(MostSegments(MakeResiduals(scene, {}, parameters, Observe(scene, 1, 0.002, 3))), 201);
}

TEST(ShootingTest, FindsAPeriodFromWhichOneRunStrays) {
  Scene scene = MakeScene(kPendulum);
  scene.simulation.duration = 8.0;
  const std::vector<Observation> observations = Observe(scene, 4, 0.002, 3);
  FitParameter gravity = Parameter("gravity/y", -2.5);
  gravity.upper = -1.0;
  gravity.lower = -20.0;
  const std::vector<FitParameter> parameters = {gravity, Parameter("joints/pin/angle", 0.7)};
  FitOptions options;
  options.approach = FitApproach::kPlain;
  options.profile_pass = ProfilePass::kSkip;  // which would find the other minimum
  RolloutResiduals single = MakeResiduals(scene, {}, parameters, observations);
  const FitResult strayed = Fit(options, &single, {});
  EXPECT_GT(strayed.uncertainty.reduced_chi_square, 100.0);

  options.approach = FitApproach::kSegments;
  options.segments = 8;
  RolloutResiduals multiple = MakeResiduals(scene, {}, parameters, observations);
  const FitResult fit = Fit(options, &multiple, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  EXPECT_NEAR(fit.estimate[0], -9.81, 5.0 * fit.uncertainty.standard_deviation[0]);
  EXPECT_NEAR(fit.estimate[1], 1.0, 5.0 * fit.uncertainty.standard_deviation[1]);
  EXPECT_GT(fit.starts[0].approach_iterations, 0);

  // From where one run does find its way both are the same estimate.
  std::vector<FitParameter> near = parameters;
  near[0].initial = -9.7;
  near[1].initial = 1.02;
  RolloutResiduals close = MakeResiduals(scene, {}, near, observations);
  options.approach = FitApproach::kPlain;
  const FitResult direct = Fit(options, &close, {});
  EXPECT_NEAR(direct.estimate[0], fit.estimate[0], 1e-9 * 9.81);
}

}  // namespace
}  // namespace tangible
