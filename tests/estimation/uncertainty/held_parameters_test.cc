// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/held_parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/held_refit.h"

namespace tangible {
namespace {

/// A fit of a pendulum that is held at another damping than the true one.
FitResult FitWithWrongDamping(double held, const std::vector<FitParameter>& parameters) {
  Scene scene = MakeScene(kPendulum);  // damping 0.05
  const std::vector<Observation> observations = Observe(scene, 2, 1e-3, 5);
  scene.joints[0].damping = held;
  RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
  return Fit(FitOptions(), &residuals, {});
}

const HeldParameter* Find(const FitResult& result, const std::string& path) {
  const auto found = std::find_if(result.held.begin(), result.held.end(),
                                  [&](const HeldParameter& held) { return held.path == path; });
  return found == result.held.end() ? nullptr : &*found;
}

TEST(HeldParametersTest, FindsTheNumberThatIsHeldAtAWrongValue) {
  const FitResult result = FitWithWrongDamping(
      0.04, {Parameter("joints/pin/angle", 0.8), Parameter("joints/pin/rate", 0.0)});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const HeldParameter* const damping = Find(result, "joints/pin/damping");
  ASSERT_NE(damping, nullptr);
  EXPECT_EQ(damping->value, 0.04);
  // The change is that of a linear model: two percent of the true one are its curvature.
  EXPECT_NEAR(damping->change, 0.01, 0.001);
  EXPECT_GT(damping->cost_share, 0.85);  // the rest is noise
  EXPECT_LE(damping->cost_share, 1.0 + 1e-12);
  // The real fit has no curvature left.
  EXPECT_TRUE(damping->refitted);
  EXPECT_NEAR(damping->refitted_value, 0.05, 2e-4);
  EXPECT_NEAR(damping->refitted_share, damping->cost_share, 0.1);
  EXPECT_NE(Describe(*damping).find("fitted with the others it becomes 0.05"), std::string::npos)
      << Describe(*damping);
  EXPECT_TRUE(std::any_of(result.uncertainty.warnings.begin(), result.uncertainty.warnings.end(),
                          [](const std::string& warning) {
                            return warning.find(
                                       "the observations contradict 'joints/pin/damping'") == 0;
                          }));
}

TEST(HeldParametersTest, FindsWhatDrivesAnotherIntoItsBound) {
  // Without its drag the ball seems to fall more slowly than the bounds of gravity allow.
  Scene scene = MakeScene(kFallingBall);  // damping 0.3
  const std::vector<Observation> observations = Observe(scene, 2, 1e-3, 5);
  scene.bodies[0].linear_damping = 0.0;
  FitParameter gravity = Parameter("gravity/y", -9.8);
  gravity.lower = -20.0;
  gravity.upper = -9.75;
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {gravity, Parameter("bodies/ball/velocity/y", 3.0)}, observations);
  const FitResult result = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  ASSERT_EQ(result.estimate[0], -9.75);
  const HeldParameter* const damping = Find(result, "bodies/ball/linear_damping");
  ASSERT_NE(damping, nullptr);
  EXPECT_NEAR(damping->change, 0.3, 0.1);
  ASSERT_EQ(damping->releases.size(), 1u);
  EXPECT_EQ(damping->releases[0], "gravity/y");
  EXPECT_NE(Describe(*damping).find("it drives 'gravity/y' into the bound"), std::string::npos)
      << Describe(*damping);
}

TEST(HeldParametersTest, NothingIsContradictedByAModelThatFits) {
  const FitResult result = FitWithWrongDamping(
      0.05, {Parameter("joints/pin/angle", 0.8), Parameter("joints/pin/rate", 0.0)});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  EXPECT_TRUE(result.held.empty());
}

TEST(HeldParametersTest, ATruthAtTheBoundIsNotBlamedOnOthers) {
  Scene scene = MakeScene(kPendulum);
  scene.bodies[0].linear_damping = 0.0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RolloutResiduals residuals = MakeResiduals(
        scene, {}, {Parameter("bodies/bob/linear_damping", 0.1)}, Observe(scene, 2, 1e-3, seed));
    const FitResult result = Fit(FitOptions(), &residuals, {});
    EXPECT_TRUE(result.held.empty()) << seed << ": " << Describe(result.held.front());
  }
}

/// r_i = a (−1)^i + 1 − 0.02 tanh(50 θ): to first order θ explains all of it, in truth 4 %.
class SaturatingProblem : public LeastSquaresProblem {
 public:
  explicit SaturatingProblem(bool released) {
    entries_ = {{"a", 0.5, -10.0, 10.0, false, 1.0}};
    if (released) entries_.push_back({"theta", 0.0, -10.0, 10.0, false, 1.0});
  }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return static_cast<int>(entries_.size()); }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return 40; }
  std::vector<RowPlace> Places(int /*block*/) const override {
    std::vector<RowPlace> places;
    for (int i = 0; i < num_rows(0); ++i) places.push_back({0, static_cast<double>(i), 0.0});
    return places;
  }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    evaluation->residuals.resize(num_rows(0));
    evaluation->jacobian.resize(num_rows(0), p.size());
    const double moved = p.size() > 1 ? std::tanh(50.0 * p[1]) : 0.0;
    for (int i = 0; i < num_rows(0); ++i) {
      const double sign = i % 2 == 0 ? 1.0 : -1.0;
      evaluation->residuals[i] = p[0] * sign + 1.0 - 0.02 * moved;
      evaluation->jacobian(i, 0) = sign;
      if (p.size() > 1) evaluation->jacobian(i, 1) = moved * moved - 1.0;
    }
    return true;
  }
  HeldColumns EvaluateHeld(int /*block*/, const Eigen::VectorXd& /*p*/, GradientMethod /*method*/,
                           int /*most*/) override {
    return {{{"theta", 0.0, -10.0, 10.0, false, 1.0}}, RowMatrixXd::Constant(num_rows(0), 1, -1.0)};
  }
  std::unique_ptr<LeastSquaresProblem> Released(const std::string& /*path*/) const override {
    return std::make_unique<SaturatingProblem>(true);
  }

 private:
  std::vector<ParameterEntry> entries_;
};

TEST(HeldParametersTest, WhatARealFitDoesNotConfirmIsNotClaimed) {
  SaturatingProblem problem(false);
  const std::vector<HeldParameter> first_order =
      FindHeldParameters(Eigen::VectorXd::Zero(1), HeldOptions(), &problem);
  ASSERT_EQ(first_order.size(), 1U);
  EXPECT_NEAR(first_order[0].cost_share, 1.0, 1e-12);
  FitResult result;
  result.estimate = Eigen::VectorXd::Zero(1);
  result.residuals = Eigen::VectorXd::Ones(problem.num_rows(0));
  result.final_cost = 0.5 * problem.num_rows(0);
  EXPECT_TRUE(ConfirmHeld(FitOptions(), HeldOptions(), first_order, &problem, &result).empty());
  // A claim of which 4 % is enough is told as what the fit has found.
  HeldOptions little;
  little.least_share = 0.03;
  const std::vector<HeldParameter> confirmed =
      ConfirmHeld(FitOptions(), little, first_order, &problem, &result);
  ASSERT_EQ(confirmed.size(), 1U);
  EXPECT_NEAR(confirmed[0].refitted_share, 1.0 - 0.98 * 0.98, 1e-6);
}

/// The same with a column of −`effect`: to first order θ would have to change by 1 / effect.
class FaintProblem : public SaturatingProblem {
 public:
  explicit FaintProblem(double effect) : SaturatingProblem(false), effect_(effect) {}
  HeldColumns EvaluateHeld(int block, const Eigen::VectorXd& p, GradientMethod method,
                           int most) override {
    HeldColumns held = SaturatingProblem::EvaluateHeld(block, p, method, most);
    held.columns *= effect_;
    return held;
  }

 private:
  double effect_;
};

// A thousand times the typical magnitude of a value, 1 here, is the most that is told.
TEST(HeldParametersTest, AChangeBeyondAllMagnitudesIsNoAdvice) {
  for (const double change : {990.0, 1010.0, 7.7e12}) {
    FaintProblem problem(1.0 / change);
    const std::vector<HeldParameter> found =
        FindHeldParameters(Eigen::VectorXd::Zero(1), HeldOptions(), &problem);
    EXPECT_EQ(found.size(), change < 1000.0 ? 1U : 0U) << change;
  }
}

}  // namespace
}  // namespace tangible
