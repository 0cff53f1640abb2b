// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/sampled_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"

namespace tangible::tradeoff {
namespace {

// A disc in free flight: its motion and derivatives are known.
constexpr char kThrow[] = R"({"gravity": [0, -10], "bodies": [
    {"name": "disc", "shape": {"circle": {"radius": 0.2}}, "mass": 2, "position": [0, 1],
     "velocity": [3, 4], "angular_velocity": 2}],
  "simulation": {"dt": 0.1, "duration": 1, "stepping": "event", "integrator": "trapezoidal"}})";

class SampledRunTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    ASSERT_TRUE(ResolveParameter(scene_, "gravity/y", &parameters_[0], &error)) << error;
  }
  SampledRun Run(GradientMethod method = GradientMethod::kAdjoint, double repeat = 0.0) {
    return RunSampled(scene_, parameters_, method, {.samples = 5, .repeat_seconds = repeat});
  }
  Scene scene_ = test_scenes::SceneOf(kThrow);
  std::vector<ParameterPath> parameters_ = std::vector<ParameterPath>(1);
};

TEST_F(SampledRunTest, SeesEqualTimesAndTheJacobianOfTheEnd) {
  const SampledRun run = Run();
  ASSERT_TRUE(run.done()) << run.message;
  ASSERT_EQ(run.poses.size(), 6u * 3u);
  for (size_t k = 0; k <= 5; ++k) {
    const double t = 0.2 * static_cast<double>(k);
    EXPECT_NEAR(run.poses[3 * k], 3.0 * t, 1e-13);
    EXPECT_NEAR(run.poses[3 * k + 1], 1.0 + 4.0 * t - 5.0 * t * t, 1e-13);
    EXPECT_NEAR(run.poses[3 * k + 2], 2.0 * t, 1e-13);
  }
  EXPECT_NEAR(run.jacobian(1, 0), 0.5, 1e-13);
  EXPECT_NEAR(run.jacobian(4, 0), 1.0, 1e-13);
  EXPECT_EQ(run.steps, 10);
  EXPECT_EQ(run.both_seconds.size(), 1u);
  EXPECT_GT(Run(GradientMethod::kAdjoint, 0.05).both_seconds.size(), 1u);
}

TEST_F(SampledRunTest, ErrorsAreThoseOfTheirFormulas) {
  const SampledRun reference = Run();
  const ErrorScale scale = ScaleOf(scene_, parameters_, reference);
  // From (0, 1) to (3, 0), 1.8 at its highest sample (0.4 s).
  EXPECT_NEAR(scale.length, std::hypot(3.0, 1.8), 1e-12);
  EXPECT_NEAR(scale.gyration[0], 0.2 / std::sqrt(2.0), 1e-15);
  SampledRun run = reference;
  EXPECT_EQ(TrajectoryError(scale, run, reference), 0.0);
  run.poses[6] += 0.03;
  run.poses[8] += 0.1;
  const double turned = 0.1 * scale.gyration[0];
  EXPECT_NEAR(TrajectoryError(scale, run, reference), std::hypot(0.03, turned) / scale.length,
              1e-14);
  // The columns' sizes are (0.5, T · 1) / L.
  run.jacobian(4, 0) += 0.25;
  EXPECT_NEAR(GradientError(scale, run, reference), 0.25 / std::hypot(0.5, 1.0), 1e-13);
  run.jacobian(0, 0) = NAN;
  EXPECT_EQ(GradientError(scale, run, reference), HUGE_VAL);
  run.poses[0] = NAN;
  EXPECT_EQ(TrajectoryError(scale, run, reference), HUGE_VAL);
}

// Semi-implicit Euler falls g t h / 2 too far, in dy/dg too: at the end 0.5 m of hypot(3, 1.8) m,
// and 0.05 of hypot(0.5, 1).
TEST_F(SampledRunTest, AFirstOrderErrorIsSeen) {
  const SampledRun reference = Run(GradientMethod::kTangent);
  const ErrorScale scale = ScaleOf(scene_, parameters_, reference);
  scene_.simulation.stepping = Stepping::kFixed;
  scene_.simulation.integrator = Integrator::kSemiImplicitEuler;
  const SampledRun run = Run();
  EXPECT_NEAR(TrajectoryError(scale, run, reference), 0.5 / std::hypot(3.0, 1.8), 1e-12);
  EXPECT_NEAR(GradientError(scale, run, reference), 0.05 / std::hypot(0.5, 1.0), 1e-12);
}

TEST_F(SampledRunTest, NothingDependsOnWhatDoesNotMatter) {
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene_, "bodies/disc/friction", &parameters_[0], &error));
  const SampledRun run = Run();
  EXPECT_TRUE(std::isnan(GradientError(ScaleOf(scene_, parameters_, run), run, run)));
}

TEST_F(SampledRunTest, FailuresHaveAMessage) {
  scene_.simulation.stepping = Stepping::kFixed;
  EXPECT_EQ(Run().message.find("/simulation/integrator"), 0u);
}

}  // namespace
}  // namespace tangible::tradeoff
