// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/held_parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/fit.h"

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

}  // namespace
}  // namespace tangible
