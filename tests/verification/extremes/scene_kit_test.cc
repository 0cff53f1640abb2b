// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/scene_kit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace tangible::extremes {
namespace {

Scene FallingDisc(double height) {
  Scene scene = NewScene("disc", "fixed", 0.01, 0.1);
  AddDisc(&scene, "disc", 0.5, 2.0, 0.0, height);
  AddFloor(&scene);
  SetMaterial(&scene, 0.5, 0.0);
  return scene;
}

TEST(RunSceneTest, MeasuresAFall) {
  const MeasuredRun run = RunScene(FallingDisc(10.0));
  const double fall = 0.5 * 9.81 * 0.1 * 0.11;
  EXPECT_EQ(run.report.status, StepStatus::kDone);
  EXPECT_NEAR(run.y("disc"), 10.0 - fall, 1e-12);
  EXPECT_NEAR(run.moved, fall, 1e-12);
  EXPECT_NEAR(run.speed_end, 0.981, 1e-12);
  EXPECT_EQ(run.speed_max, run.speed_end);
  EXPECT_EQ(run.penetration, 0.0);
  // Of semi-implicit Euler: m g h v / 2.
  EXPECT_NEAR(run.energy_end - run.energy_start, -0.5 * 2.0 * 9.81 * 0.01 * 0.981, 1e-9);
  EXPECT_THROW(run.y("nobody"), std::invalid_argument);
}

TEST(RunSceneTest, MeasuresWeightAndOverlap) {
  const MeasuredRun rest = RunScene(FallingDisc(0.5));
  EXPECT_NEAR(rest.NormalImpulse("disc", "floor"), 2.0 * 9.81 * 0.01, 1e-12);
  EXPECT_NEAR(rest.NormalImpulse("floor", "disc"), 2.0 * 9.81 * 0.01, 1e-12);
  Scene deep = FallingDisc(0.2);
  deep.simulation.duration = 0.01;
  EXPECT_NEAR(RunScene(deep).penetration, 0.3, 1e-12);
}

TEST(RunSceneTest, WhatAFileMayNotHoldIsRefused) {
  Scene scene = FallingDisc(1.0);
  scene.bodies[0].mass = -1.0;
  EXPECT_THROW(RunScene(scene), std::invalid_argument);
}

TEST(AddChainTest, HangsFromItsPin) {
  Scene scene = NewScene("chain", "fixed", 0.01, 0.1);
  AddChain(&scene, 4, 0.5, 1.0, 1.0, 2.0, Top::kPinned);
  ASSERT_EQ(scene.bodies.size(), 4u);
  ASSERT_EQ(scene.joints.size(), 4u);
  const MeasuredRun run = RunScene(scene);
  EXPECT_LE(run.joint_drift, 1e-14);
  EXPECT_LE(run.moved, 1e-14);
  Scene free = NewScene("chain", "fixed", 0.01, 0.1);
  AddChain(&free, 4, 0.5, 1.0, 1.0, 2.0, Top::kFree);
  EXPECT_EQ(free.joints.size(), 3u);
}

TEST(AddDoneTest, AFailedRunDoesNotHold) {
  Finding finding;
  MeasuredRun run;
  AddDone(run, &finding);
  EXPECT_TRUE(finding.holds());
  run.report.status = StepStatus::kUnsolved;
  run.report.message = "why";
  AddDone(run, &finding);
  EXPECT_FALSE(finding.holds());
  EXPECT_EQ(finding.note, "why");
}

TEST(AddGradientTest, MethodsAgreeOnAFall) {
  Finding finding;
  AddGradient(FallingDisc(10.0), 5, {"gravity/y", "bodies/disc/mass"}, Differences::kTake,
              &finding);
  EXPECT_TRUE(finding.gradient.taken && finding.gradient.finite) << finding.gradient.message;
  EXPECT_EQ(finding.gradient.verdict, "trustworthy");
  EXPECT_LE(finding.gradient.adjoint, 1e-12);
  EXPECT_LE(finding.gradient.differences, 1e-5);
  EXPECT_TRUE(finding.gradient.holds());
}

TEST(AddGradientTest, AnUnknownParameterIsAnError) {
  Finding finding;
  AddGradient(FallingDisc(10.0), 5, {"bodies/nobody/mass"}, Differences::kSkip, &finding);
  EXPECT_NE(finding.gradient.message, "");
  EXPECT_FALSE(finding.holds());
}

}  // namespace
}  // namespace tangible::extremes
