// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Small scenes to be identified, and observations of them made without the code under test.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/stepping/rollout.h"
#include "thorough.h"

namespace tangible {

/// Fits of a calibration; 500 where the test is not to be quick.
inline int NumReplicas() {
  const char* const text = std::getenv("TANGIBLE_CALIBRATION_REPLICAS");
  return text != nullptr ? std::atoi(text) : testing::Thorough() ? 40 : 20;
}

inline constexpr char kFallingBall[] = R"({"name": "falling ball", "bodies": [
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 10],
   "velocity": [1, 3], "linear_damping": 0.3}],
  "simulation": {"dt": 0.01, "duration": 1}})";

inline constexpr char kSlidingBox[] = R"({"name": "sliding box", "bodies": [
  {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
   "velocity": [3, 0], "friction": 0.4},
  {"name": "floor", "static": true, "friction": 0.2,
   "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "forces": [{"name": "push", "body": "box", "force": [1.5, 0.5], "start": 0.1, "end": 0.3}],
  "simulation": {"dt": 0.01, "duration": 0.6}})";

inline constexpr char kPendulum[] = R"({"name": "pendulum", "bodies": [
  {"name": "bob", "mass": 0.5, "inertia": 0.02, "position": [0, -1]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"], "anchor": [0, 0],
              "angle": 1.0, "rate": 0.3, "damping": 0.05}],
  "simulation": {"dt": 0.01, "duration": 2, "joint_correction": "projection"}})";

/// Three links on a pin, hit by a ball that slides along the lowest one.
inline constexpr char kSmallChain[] = R"({"name": "small chain", "bodies": [
  {"name": "link0", "shape": {"capsule": {"length": 0.24, "radius": 0.03}}, "mass": 0.7,
   "position": [0, 1.85], "angle": -1.5707963267948966, "friction": 0.05, "restitution": 0.2},
  {"name": "link1", "shape": {"capsule": {"length": 0.24, "radius": 0.03}}, "mass": 0.7,
   "position": [0, 1.55], "angle": -1.5707963267948966, "friction": 0.05, "restitution": 0.2},
  {"name": "link2", "shape": {"capsule": {"length": 0.24, "radius": 0.03}}, "mass": 0.7,
   "position": [0, 1.25], "angle": -1.5707963267948966, "friction": 0.05, "restitution": 0.2},
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [-0.4, 1.2],
   "velocity": [3, 1.8], "friction": 0.05, "restitution": 0.2}],
  "joints": [
  {"name": "j0", "type": "revolute", "bodies": ["link0", "world"], "anchor": [0, 2], "damping": 0.01},
  {"name": "j1", "type": "revolute", "bodies": ["link1", "link0"], "anchor": [0, 1.7],
   "damping": 0.01, "angle": 0.1},
  {"name": "j2", "type": "revolute", "bodies": ["link2", "link1"], "anchor": [0, 1.4], "damping": 0.01}],
  "no_contact": [["link*", "link*"]],
  "simulation": {"dt": 0.005, "duration": 0.5, "joint_correction": "projection"}})";

inline Scene MakeScene(const std::string& text) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(text, "scene.json", "", &scene, &error)) << error;
  return scene;
}

/// Every moving body's x, y and angle, each `every` steps, with Gaussian noise of standard
/// deviation sigma; a sigma of 0 is observed without noise and weighed as 1e-3.
inline std::vector<Observation> Observe(const Scene& scene, int every, double sigma,
                                        unsigned seed) {
  Model<double> model;
  State<double> initial;
  State<double> final;
  BuildModel(scene, &model, &initial);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Observation> observations;
  const StateObserver observer = [&](long k, double t, const State<double>& state, Stepper*) {
    for (size_t body = 0; body < scene.bodies.size() && k % every == 0; ++body) {
      for (int i = 0; i < 3 && scene.bodies[body].motion == Motion::kMoving; ++i) {
        const double noise = sigma > 0.0 ? sigma * normal(random) : 0.0;
        observations.push_back({t, static_cast<int>(body), -1, static_cast<Coordinate>(i),
                                state.pose[3 * body + i] + noise, sigma > 0.0 ? sigma : 1e-3});
      }
    }
  };
  const RolloutReport report = Rollout(model, initial, observer, &final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return observations;
}

inline FitParameter Parameter(const std::string& path, double initial) {
  FitParameter parameter;
  parameter.name = path;
  parameter.initial = initial;
  parameter.sets = {{path}};
  return parameter;
}

inline RolloutResiduals MakeResiduals(const Scene& scene, const std::vector<BodyPoint>& points,
                                      const std::vector<FitParameter>& parameters,
                                      const std::vector<Observation>& observations) {
  ParameterizedScene parameterized;
  ParameterError error;
  EXPECT_TRUE(parameterized.Create(scene, points, parameters, &error)) << error.what;
  return RolloutResiduals(parameterized, observations);
}

}  // namespace tangible
