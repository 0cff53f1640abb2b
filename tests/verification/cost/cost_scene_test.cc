// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_scene.h"

#include <gtest/gtest.h>

#include <set>

#include "tangible/simulation/stepping/rollout.h"

namespace tangible::cost {
namespace {

void ExpectThatTheBallHitsTheChain(const Scene& scene) {
  EXPECT_EQ(NumSteps(scene.simulation), 300);
  EXPECT_EQ(scene.bodies.size(), 11U);
  EXPECT_EQ(scene.joints.size(), 10U);
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  const RolloutReport report = Rollout(model, initial, {}, &final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_GE(report.contacts_max, 1);
  EXPECT_LT(final.twist[3 * 10], 3.0);  // it had 4 m/s
}

TEST(ChainAndBallTest, TheBallHitsTheChain) {
  ExpectThatTheBallHitsTheChain(ChainAndBall(300));
  const Scene by_events = ChainAndBall(300, Stepping::kEvent);
  EXPECT_EQ(by_events.simulation.stepping, Stepping::kEvent);
  ExpectThatTheBallHitsTheChain(by_events);
}

TEST(CostParametersTest, AreAsManyAsWanted) {
  const Scene scene = ChainAndBall(10);
  const int numbers = NumNumbers(scene);
  EXPECT_EQ(numbers, 215);
  for (const int count : {1, 8, numbers, 256, 1000}) {
    const std::vector<ParameterPath> parameters = CostParameters(scene, count);
    ASSERT_EQ(static_cast<int>(parameters.size()), count);
    std::set<std::string> paths;
    for (const ParameterPath& parameter : parameters) paths.insert(parameter.path);
    EXPECT_GE(static_cast<int>(paths.size()), std::min(count, 240)) << count;
  }
  const std::vector<ParameterPath> all = CostParameters(scene, 256);
  EXPECT_EQ(all[0].path, "bodies/ball/velocity/x");
  EXPECT_EQ(all[1].path, "bodies/link0/mass");
  EXPECT_EQ(all[12].path, "bodies/link0/friction");
  EXPECT_EQ(all[numbers].path, "bodies/*/velocity/x");
  EXPECT_EQ(all[numbers].numbers.size(), 11U);
}

}  // namespace
}  // namespace tangible::cost
