// SPDX-License-Identifier: Apache-2.0
#include "run_scene.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "expect.h"
#include "tangible/dynamics/model/model.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible::testing {
namespace {

constexpr size_t kMostBodies = 12;
constexpr size_t kMostNumbers = 64;
constexpr int kSteps = 4;

bool Finite(const State<double>& state) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(state.pose.begin(), state.pose.end(), finite) &&
         std::all_of(state.twist.begin(), state.twist.end(), finite);
}

}  // namespace

bool FitToRun(const Scene& scene) {
  if (scene.bodies.size() > kMostBodies || scene.joints.size() > kMostBodies) return false;
  if (scene.simulation.max_events_per_step > 1000 || scene.simulation.lcp_max_iterations > 1000) {
    return false;
  }
  return std::all_of(scene.bodies.begin(), scene.bodies.end(), [](const auto& body) {
    return body.shape.numbers.size() + 2 * body.contact_points.size() <= kMostNumbers;
  });
}

void RunFewSteps(Scene scene, Stepping stepping) {
  scene.simulation.stepping = stepping;
  scene.simulation.duration = std::min(scene.simulation.duration, kSteps * scene.simulation.dt);
  // An event costs up to a thousand evaluations of the motion.
  scene.simulation.max_events_per_step = std::min(scene.simulation.max_events_per_step, 5);
  std::string why;
  if (!CheckSettings(scene, &why)) {
    Expect(!why.empty() && why.find('\n') == std::string::npos, "one line", why);
    return;
  }
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  // Joint rates on arms of 1e308 m: said to have diverged before the first step.
  const bool finite = Finite(state);
  State<double> final = state;
  const RolloutReport report = Rollout(model, state, {}, &final);
  Expect(report.status == StepStatus::kDone || !report.message.empty(), "a message", "none");
  Expect(report.message.find('\n') == std::string::npos, "one line", report.message);
  Expect(finite ? Finite(final) : report.status != StepStatus::kDone, "finite numbers",
         report.message);
}

}  // namespace tangible::testing
