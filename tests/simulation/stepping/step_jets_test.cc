// SPDX-License-Identifier: Apache-2.0
//
// Steps in Jets against the tangent of the same step, and by hand.
#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

#define TANGIBLE_LIST_WIDTH(N) N,
constexpr int kWidths[] = {TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_LIST_WIDTH) 0};
#undef TANGIBLE_LIST_WIDTH

// A ball that slides for 10 steps: x = … − μ g h² 55, μ half of the ball's own.
template <int N>
void CheckSliding(JetRoute route, double tolerance) {
  if constexpr (N == 0) {
    GTEST_SKIP() << "built without Jets";
  } else {
    Scene scene =
        test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01, "duration": 0.1})"));
    scene.bodies[0].velocity.x() = 3.0;
    BasicScene<Jet<N>> jets = CastScene<Jet<N>>(scene);
    jets.bodies[0].friction.v[0] = 1.0;
    jets.bodies[0].velocity.x().v[1] = 1.0;
    Model<Jet<N>> model;
    State<Jet<N>> state;
    BuildModel(jets, &model, &state);
    long fallbacks = 0;
    long calls = 0;
    const RolloutReport report = RolloutJets<Jet<N>>(
        model, state, route, [&](long, double, const State<Jet<N>>&, Stepper*) { ++calls; }, &state,
        &fallbacks);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_EQ(fallbacks, 0);
    EXPECT_EQ(calls, 11);
    EXPECT_NEAR(state.pose[0].v[0], -0.5 * 9.81 * 1e-4 * 55.0, tolerance);
    EXPECT_NEAR(state.pose[0].v[1], 0.1, tolerance);
    EXPECT_NEAR(state.pose[1].v[0], 0.0, tolerance);
  }
}

TEST(StepJetsTest, ImplicitSliding) { CheckSliding<kWidths[0]>(JetRoute::kImplicit, 1e-13); }
TEST(StepJetsTest, UnrolledSliding) { CheckSliding<kWidths[0]>(JetRoute::kUnrolled, 1e-9); }

// A body at rest: zero-valued entries must keep their derivatives.
template <int N>
void CheckResting(JetRoute route) {
  if constexpr (N == 0) {
    GTEST_SKIP() << "built without Jets";
  } else {
    const Scene scene =
        test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01, "duration": 0.05})"));
    BasicScene<Jet<N>> jets = CastScene<Jet<N>>(scene);
    jets.bodies[0].velocity.x().v[0] = 1.0;
    jets.bodies[1].shape.numbers[2].v[1] = 1.0;
    Model<Jet<N>> model;
    State<Jet<N>> state;
    BuildModel(jets, &model, &state);
    long fallbacks = 0;
    ASSERT_EQ(RolloutJets<Jet<N>>(model, state, route, {}, &state, &fallbacks).status,
              StepStatus::kDone);
    // It sticks at once, so it rolls: two thirds of the speed stay. It rises with the floor.
    EXPECT_NEAR(state.twist[0].v[0], 2.0 / 3.0, 1e-8);
    EXPECT_NEAR(state.twist[2].v[0], -20.0 / 3.0, 1e-7);
    EXPECT_NEAR(state.pose[1].v[1], 1.0, 1e-8);
  }
}

TEST(StepJetsTest, ImplicitAtRest) { CheckResting<kWidths[0]>(JetRoute::kImplicit); }
TEST(StepJetsTest, UnrolledAtRest) { CheckResting<kWidths[0]>(JetRoute::kUnrolled); }

}  // namespace
}  // namespace tangible
