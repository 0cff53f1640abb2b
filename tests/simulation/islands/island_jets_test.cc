// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_jets.h"

#include <gtest/gtest.h>

#include "../../support/jets.h"
#include "island_scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::Row;
using test_scenes::SceneOf;

// A step in which one ball is in flight, one lands and one is on the belt: the derivatives by the
// belt's speed, by both routes, are those of the tangent.
TEST(IslandJets, AgreeWithTheTangent) {
  if (!testing::HaveJets()) GTEST_SKIP() << "built without Jets";
  constexpr int kWidth = testing::WidestJet() > 0 ? testing::WidestJet() : 1;
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Row({0, 1, 2, 3, 4, 5}, 1.0)), &model, &state);
  const ModelStructure& s = *model.structure;
  Stepper stepper(model);
  int compared = 0;
  for (int k = 0; k < 60; ++k) {
    const State<double> before = state;
    const StepReport report = stepper.Step(model, 0.01 * k, 0.01, &state);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    if (report.islands < 2 || report.events == 0) continue;
    ++compared;
    RowMatrixXd w_dot = RowMatrixXd::Zero(s.num_variables(), 1);
    w_dot(s.TwistVariable(1, 0), 0) = 1.0;
    w_dot(s.TwistVariable(2, 1), 0) = 0.5;
    stepper.Tangent(model, {}, &w_dot);
    for (const JetRoute route : {JetRoute::kImplicit, JetRoute::kUnrolled}) {
      const auto jets_of = [](const std::vector<double>& values) {
        return std::vector<Jet<kWidth>>(values.begin(), values.end());
      };
      const Model<Jet<kWidth>> jets{model.structure, jets_of(model.parameters)};
      State<Jet<kWidth>> at{jets_of(before.pose), jets_of(before.twist)};
      at.twist[3].v[0] = 1.0;
      at.twist[7].v[0] = 0.5;
      IslandStepInJets(jets, model, route, &stepper.mutable_parts(), &at);
      for (int i = 0; i < static_cast<int>(at.pose.size()); ++i) {
        EXPECT_NEAR(at.pose[i].v[0], w_dot(s.PoseVariable(0, i), 0), 1e-9) << k << " " << i;
        EXPECT_NEAR(at.twist[i].v[0], w_dot(s.TwistVariable(0, i), 0), 1e-9) << k << " " << i;
      }
    }
  }
  EXPECT_GT(compared, 3);
}

}  // namespace
}  // namespace tangible
