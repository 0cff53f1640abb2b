// SPDX-License-Identifier: Apache-2.0
//
// What slides over flush tiles moves as on one floor, whatever rounding makes of the corners that
// it passes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

std::string Number(double x) {
  std::ostringstream text;
  text.precision(17);
  text << x;
  return text.str();
}

std::string Pair(double x, double y) { return "[" + Number(x) + ", " + Number(y) + "]"; }

struct Slide {
  double tilt = 0.0;
  double width = 1.0;
  double height = 0.5;
  double from = 0.0;  // m along the floor
  double speed = 2.0;
  double friction = 0.0;
  double x = 0.0;  // m, where the scene's origin lies
  double y = 0.0;
  std::vector<double> tiles = {1.0, 1.0, 1.0, 1.0, 1.0};  // from −1.5 on, in the scene of tiles
};

Scene SceneOfSlide(const Slide& slide, Stepping stepping, bool on_tiles) {
  const double c = std::cos(slide.tilt);
  const double s = std::sin(slide.tilt);
  const auto at = [&](double x, double y) { return Pair(c * x - s * y, s * x + c * y); };
  const auto place = [&](double x, double y) {
    return Pair(slide.x + c * x - s * y, slide.y + s * x + c * y);
  };
  const std::string friction = R"(, "friction": )" + Number(slide.friction) + "}";
  const std::string angle = R"(, "angle": )" + Number(slide.tilt);
  std::string bodies = R"({"name": "box", "mass": 1, "shape": {"box": {"size": )" +
                       Pair(slide.width, slide.height) + R"(}}, "position": )" +
                       place(slide.from, 0.5 * slide.height) + R"(, "velocity": )" +
                       at(slide.speed, 0.0) + angle + friction;
  double start = -1.5;
  for (size_t i = 0; i < slide.tiles.size() && on_tiles; ++i) {
    bodies += R"(, {"name": "tile)" + std::to_string(i) +
              R"(", "static": true, "shape": {"box": {"size": )" + Pair(slide.tiles[i], 1.0) +
              R"(}}, "position": )" + place(start + 0.5 * slide.tiles[i], -0.5) + angle + friction;
    start += slide.tiles[i];
  }
  if (!on_tiles) {
    bodies +=
        R"(, {"name": "floor", "static": true, "shape": {"half_plane": {"offset": 0, "normal": )" +
        Pair(-s, c) + "}}" + friction;
  }
  Scene scene =
      test_scenes::SceneOf(R"({"bodies": [)" + bodies + R"(], "gravity": )" + at(0.0, -9.81) +
                           R"(, "simulation": {"dt": 0.01, "duration": 0.5}})");
  scene.simulation.stepping = stepping;
  scene.simulation.integrator =
      stepping == Stepping::kEvent ? Integrator::kTrapezoidal : Integrator::kSemiImplicitEuler;
  return scene;
}

State<double> EndOf(const Scene& scene, RolloutReport* report) {
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  *report = Rollout(model, initial, nullptr, &final);
  return final;
}

void ExpectAsOnAFloor(const Slide& slide, const std::string& what) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    RolloutReport report;
    const State<double> floor = EndOf(SceneOfSlide(slide, stepping, false), &report);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    const State<double> tiles = EndOf(SceneOfSlide(slide, stepping, true), &report);
    ASSERT_EQ(report.status, StepStatus::kDone) << what << ": " << report.message;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(tiles.pose[i], floor.pose[i], 1e-7)
          << what << ", stepping " << static_cast<int>(stepping);
      EXPECT_NEAR(tiles.twist[i], floor.twist[i], 1e-7)
          << what << ", stepping " << static_cast<int>(stepping);
    }
  }
}

TEST(SeamsTest, ABoxSlidesOverFlushTilesAsOverAFloor) {
  // To the left and to the right, where corners meet at a step's end and where they do not.
  for (const double speed : {2.0, -2.0, 1.7}) {
    for (const double from : {0.4, -0.4, 0.1}) {
      Slide slide;
      slide.from = from;
      slide.speed = speed;
      ExpectAsOnAFloor(slide, "speed " + Number(speed) + " from " + Number(from));
    }
  }
}

TEST(SeamsTest, WhateverTheTiltAndTheSizes) {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int k = 0; k < 40; ++k) {
    Slide slide;
    slide.tilt = uniform(-0.6, 0.6);
    slide.width = uniform(0.3, 0.9);
    slide.height = uniform(0.2, 0.6);
    slide.speed = (k % 2 == 0 ? 1.0 : -1.0) * uniform(0.5, 2.5);
    slide.friction = k % 3 == 0 ? uniform(0.0, 0.3) : 0.0;
    slide.from = 1.0;
    slide.tiles.clear();
    for (double length = 0.0; length < 5.0; length += slide.tiles.back()) {
      slide.tiles.push_back(uniform(0.3, 1.2));
    }
    ExpectAsOnAFloor(slide, "slide " + std::to_string(k));
  }
}

// Where poses round to 1e-10 m tiles are at heights that differ by that, and so is what slides over
// them. It keeps its speed all the same, in few steps and in many.
TEST(SeamsTest, AMillionMetresFromTheOrigin) {
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int k = 0; k < 50; ++k) {
    Slide slide;
    slide.x = k % 2 == 0 ? 1e6 : uniform(-1e6, 1e6);
    slide.y = k % 2 == 0 ? 1e6 : uniform(-1e6, 1e6);
    slide.tilt = k % 4 < 2 ? 0.0 : uniform(-0.6, 0.6);
    slide.width = 0.5;
    slide.height = uniform(0.3, 0.5);
    slide.speed = k % 3 == 0 ? -2.0 : 2.0;
    slide.from = 1.0;
    slide.tiles.clear();
    for (double length = 0.0; length < 5.0; length += slide.tiles.back()) {
      slide.tiles.push_back(uniform(0.3, 1.2));
    }
    for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
      Scene scene = SceneOfSlide(slide, stepping, true);
      scene.simulation.dt = k % 5 == 0 ? 0.001 : 0.01;
      RolloutReport report;
      const State<double> final = EndOf(scene, &report);
      ASSERT_EQ(report.status, StepStatus::kDone) << "slide " << k << ": " << report.message;
      const double c = std::cos(slide.tilt);
      const double s = std::sin(slide.tilt);
      EXPECT_NEAR(c * final.twist[0] + s * final.twist[1], slide.speed, 1e-6)
          << "slide " << k << ", stepping " << static_cast<int>(stepping);
      EXPECT_NEAR(c * final.twist[1] - s * final.twist[0], 0.0, 1e-5);
      EXPECT_NEAR(final.twist[2], 0.0, 1e-5);
      const double along = c * (final.pose[0] - slide.x) + s * (final.pose[1] - slide.y);
      EXPECT_NEAR(along, slide.from + 0.5 * slide.speed, 1e-6);
      EXPECT_NEAR(final.pose[2], slide.tilt, 1e-7);
    }
  }
}

// Rounding names one of two vertices that lie over each other, now this and now that one.
TEST(SeamsTest, NamesThatRoundingChangesAreNoEvents) {
  const Scene scene = test_scenes::SceneOf(R"({"gravity": [2.899053227347741, -9.371850958322195],
    "bodies": [
      {"name": "box", "mass": 1, "shape": {"box": {"size": [0.5, 0.1]}}, "angle": 0.3,
       "position": [-0.014776010333066978, 0.047766824456280305],
       "velocity": [2.866009467376818, 0.8865606199840186]},
      {"name": "t2", "static": true, "shape": {"box": {"size": [0.33, 0.5]}},
       "position": [-0.09330383393164611, -0.2905501584471359], "angle": 0.3},
      {"name": "t3", "static": true, "shape": {"box": {"size": [0.33, 0.5]}},
       "position": [0.22195720747980385, -0.19302849024889385], "angle": 0.3},
      {"name": "t4", "static": true, "shape": {"box": {"size": [0.33, 0.5]}},
       "position": [0.5372182488912539, -0.09550682205065178], "angle": 0.3},
      {"name": "t5", "static": true, "shape": {"box": {"size": [0.33, 0.5]}},
       "position": [0.8524792903027039, 0.002014846147590288], "angle": 0.3}],
    "simulation": {"dt": 0.01, "duration": 0.3, "stepping": "event", "integrator": "trapezoidal"}})");
  RolloutReport report;
  const State<double> final = EndOf(scene, &report);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_NEAR(std::hypot(final.twist[0], final.twist[1]), 3.0, 1e-9);
}

// A tile that is higher by more than any tolerance does stop it.
TEST(SeamsTest, AStepInTheFloorStopsTheBox) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    Scene scene = SceneOfSlide(Slide(), stepping, true);
    scene.bodies[4].position[1] += 1e-6;
    scene.simulation.duration = 0.7;
    RolloutReport report;
    const State<double> final = EndOf(scene, &report);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_LT(final.twist[0], 0.5);
  }
}

// Where a floor begins to rise a box's corner meets the ramp's first corner. Along the line between
// the two corners it would be stopped; the ramp's face only turns it upwards: without friction and
// rotation (a heavy moment of inertia) the speed along the ramp is kept.
TEST(SeamsTest, ACornerThatMeetsTheFootOfARampMeetsItsFace) {
  constexpr double kSlope = 0.1;
  Scene scene = SceneOfSlide({.from = 0.0, .speed = 2.0}, Stepping::kEvent, true);
  BasicBody<double>& ramp = scene.bodies[4];  // begins at x = 1.5
  const double c = std::cos(kSlope);
  const double s = std::sin(kSlope);
  ramp.angle = kSlope;
  ramp.position[0] = 1.5 + 0.5 * c + 0.5 * s;
  ramp.position[1] = 0.5 * s - 0.5 * c;
  scene.bodies.pop_back();
  scene.bodies[0].inertia = 1e9;
  scene.gravity = {0.0, 0.0};
  scene.simulation.duration = 0.6;
  RolloutReport report;
  const State<double> final = EndOf(scene, &report);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_NEAR(final.twist[0], 2.0 * c * c, 1e-6);
  EXPECT_NEAR(final.twist[1], 2.0 * c * s, 1e-6);
}

TEST(SeamsTest, ACornerThatMeetsACornerIsADiscontinuity) {
  Model<double> model;
  State<double> initial;
  for (const double from : {0.4, -0.4, 0.3456}) {
    BuildModel(
        SceneOfSlide({.from = from, .speed = from < 0.0 ? 2.0 : -2.0}, Stepping::kEvent, true),
        &model, &initial);
    const Certificate certificate = CertifyRollout(model, initial);
    EXPECT_EQ(certificate.verdict.find("discontinuous: "), 0u) << certificate.verdict;
    EXPECT_NE(certificate.verdict.find("a corner meets a corner"), std::string::npos)
        << certificate.verdict;
  }
  // What slides off the end of a table meets no corner.
  Scene table = SceneOfSlide({.from = 2.6, .tiles = {5.0}}, Stepping::kEvent, true);
  table.simulation.duration = 0.3;
  BuildModel(table, &model, &initial);
  EXPECT_EQ(CertifyRollout(model, initial).verdict, "trustworthy");
}

}  // namespace
}  // namespace tangible
