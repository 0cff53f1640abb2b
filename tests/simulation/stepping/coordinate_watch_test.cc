// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/coordinate_watch.h"

#include <gtest/gtest.h>

#include <string>

#include "../../support/rescaled.h"
#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

// A box slides on a floor, another one flies alone, a third hangs from the world.
Scene SceneAt(double x, Stepping stepping, const std::string& bodies) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [)" + bodies +
                                     R"(], "simulation": {"dt": 0.01, "duration": 0.05}})");
  scene.simulation.stepping = stepping;
  return test_scenes::Rescaled(scene, {1.0, 1.0, {x, 0.0}});
}

constexpr char kSlides[] =
    R"({"name": "box", "shape": {"box": {"size": [0.6, 0.8]}}, "mass": 1, "position": [0, 0.4],
        "velocity": [0.5, 0]},
       {"name": "floor", "static": true,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
constexpr char kFlies[] =
    R"({"name": "box", "shape": {"box": {"size": [0.6, 0.8]}}, "mass": 1, "position": [0, 0.4],
        "velocity": [0.5, 0]})";

CoordinateWatch Watch(const Scene& scene, Model<double>* model) {
  State<double> initial, final;
  BuildModel(scene, model, &initial);
  CoordinateWatch watch(*model);
  watch.LookAtJoints(*model, initial, 0.0);
  const RolloutReport report = Rollout(
      *model, initial,
      [&](long, double t, const State<double>& state, Stepper* stepper) {
        if (stepper != nullptr) watch.LookAtContacts(state, t, stepper->record().contacts);
      },
      &final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return watch;
}

TEST(CoordinateWatchTest, RoundingOverSizeOfWhatTouches) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    Model<double> model;
    for (const double x : {0.0, 1e6, 3e6}) {
      const CoordinateWatch watch = Watch(SceneAt(x, stepping, kSlides), &model);
      // The box's radius is 0.5.
      EXPECT_NEAR(watch.rounding(), 64.0 * 2.220446049250313e-16 * std::max(x, 0.4) / 0.5,
                  1e-6 * watch.rounding());
      EXPECT_EQ(watch.Message(model), "");
    }
    const CoordinateWatch watch = Watch(SceneAt(1e9, stepping, kSlides), &model);
    EXPECT_NE(watch.Message(model).find("coordinates are too large: body box is 1e+09 m from the "
                                        "origin"),
              std::string::npos)
        << watch.Message(model);
    EXPECT_NE(watch.Message(model).find("round to 1.4e-05 m"), std::string::npos);
    EXPECT_NE(watch.Message(model).find("size (0.5 m)"), std::string::npos);
  }
}

TEST(CoordinateWatchTest, WhatTouchesNothingMayBeAnywhere) {
  Model<double> model;
  const CoordinateWatch watch = Watch(SceneAt(1e12, Stepping::kFixed, kFlies), &model);
  EXPECT_EQ(watch.rounding(), 0.0);
  EXPECT_EQ(watch.Message(model), "");
}

TEST(CoordinateWatchTest, JointsAndWholeTurns) {
  Scene scene = test_scenes::SceneOf(test_scenes::FourBar(R"({"duration": 0.0})"));
  Model<double> model;
  EXPECT_EQ(Watch(scene, &model).Message(model), "");
  scene.bodies[0].angle = 1e9;
  scene.bodies[0].velocity = {0.0, 0.0};
  const std::string message = Watch(scene, &model).Message(model);
  EXPECT_NE(message.find("body left has turned by 1e+09 rad"), std::string::npos) << message;
}

// At 1e6 m a box of 0.5 m keeps its certificate, at 1e9 m gaps are rounding.
TEST(CoordinateWatchTest, AGradientThereIsNotTrustworthy) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    Model<double> model;
    State<double> initial;
    BuildModel(SceneAt(1e9, stepping, kSlides), &model, &initial);
    const Certificate far = CertifyRollout(model, initial);
    EXPECT_NE(far.verdict.find("near a kink: coordinates are too large: body box"),
              std::string::npos)
        << far.verdict;
    BuildModel(SceneAt(1e6, stepping, kSlides), &model, &initial);
    const Certificate near = CertifyRollout(model, initial);
    EXPECT_EQ(near.verdict.find("coordinates"), std::string::npos) << near.verdict;
  }
}

}  // namespace
}  // namespace tangible
