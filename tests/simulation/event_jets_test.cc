// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/event_jets.h"

#include <gtest/gtest.h>

#include "../support/gradients.h"
#include "../support/jets.h"
#include "../support/scenes.h"

namespace tangible {
namespace {

constexpr char kBounce[] = R"({"gravity": [0, -10], "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 0.45],
     "velocity": [1, -3], "restitution": 0.5},
    {"name": "floor", "static": true, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.3, "duration": 0.3}})";

// One step through an impact at t = 0.1 s with v⁻ = −4 and v⁺ = 2 m/s. From a height greater by dz
// it is later by dz / 4.
template <int N>
void ExpectImpactsMoveInTime(JetRoute route) {
  Model<double> model;
  State<double> start;
  BuildModel(test_scenes::SceneOf(kBounce), &model, &start);
  Stepper stepper(model);
  State<double> after = start;
  ASSERT_EQ(stepper.Step(model, 0.0, 0.3, &after).status, StepStatus::kDone);
  Model<Jet<N>> jets;
  jets.structure = model.structure;
  for (const double number : model.numbers) jets.numbers.push_back(Jet<N>(number));
  State<Jet<N>> state;
  for (size_t i = 0; i < start.pose.size(); ++i) {
    state.pose.push_back(Jet<N>(start.pose[i]));
    state.twist.push_back(Jet<N>(start.twist[i]));
  }
  state.pose[1].v[0] = 1.0;
  EventStepInJets(jets, model, route, &stepper.events().mutable_record(),
                  &stepper.event_derivative(), &state);
  for (size_t i = 0; i < start.pose.size(); ++i) {
    EXPECT_NEAR(state.pose[i].a, after.pose[i], 1e-9) << i;
    EXPECT_NEAR(state.twist[i].a, after.twist[i], 1e-9) << i;
  }
  // v⁻ falls by g dz / 4 = 2.5 dz, v⁺ = −e v⁻ grows by 1.25 dz; then gravity acts dz / 4 less.
  EXPECT_NEAR(state.twist[1].v[0], 1.25 + 2.5, 1e-9);
  // z(T) = r + v⁺ s − ½ g s², s = 0.2 − dz / 4: 1.25 · 0.2 − (2 − 10 · 0.2) / 4.
  EXPECT_NEAR(state.pose[1].v[0], 0.25, 1e-9);
  EXPECT_NEAR(state.pose[0].v[0], 0.0, 1e-12);
}

TEST(EventJetsTest, AnImpactMovesInTime) {
  constexpr int kWidth = testing::WidestJet();
  if constexpr (kWidth > 0) {
    ExpectImpactsMoveInTime<kWidth>(JetRoute::kImplicit);
    ExpectImpactsMoveInTime<kWidth>(JetRoute::kUnrolled);
  } else {
    GTEST_SKIP() << "built without Jets";
  }
}

// Two bars on two parallel pins, hung up: one row is redundant, and what elimination leaves of its
// pivot is some thousand ε.
TEST(EventJetsTest, UnrolledJetsLeaveOutWhatIsRoundingOfARedundantRow) {
  if (!testing::HaveJets()) {
    GTEST_SKIP() << "built without Jets";
  }
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "bar1", "mass": 1.38398080916717, "inertia": 0.01263542322458177,
       "position": [2.534148383215356, 0.24777896412583356]},
      {"name": "bar2", "mass": 1.762951663950894, "inertia": 0.027847165625632702,
       "position": [2.534148383215356, 0.07277896412583355], "angle": 0.165148677414627}],
    "joints": [
      {"name": "joint0", "type": "revolute", "bodies": ["bar1", "bar2"],
       "anchor": [2.434148383215356, 0.14777896412583355]},
      {"name": "joint1", "type": "revolute", "bodies": ["bar1", "bar2"],
       "anchor": [2.634148383215356, 0.14777896412583355]},
      {"name": "joint2", "type": "revolute", "bodies": ["bar1", "world"],
       "anchor": [2.384148383215356, 0.24777896412583356]}],
    "simulation": {"dt": 0.002, "duration": 0.02, "stepping": "event",
                   "integrator": "trapezoidal", "joint_correction": "projection"}})");
  const std::vector<std::string> paths = {"bodies/*/mass", "joints/joint1/anchor/y"};
  const GradientResult adjoint = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
  const GradientResult jets = testing::Jacobian(scene, paths, GradientMethod::kJet);
  EXPECT_LT((jets.jacobian - adjoint.jacobian).cwiseAbs().maxCoeff(), 1e-8);
}

}  // namespace
}  // namespace tangible
