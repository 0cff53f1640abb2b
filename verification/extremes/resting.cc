// SPDX-License-Identifier: Apache-2.0
//
// Stacks and a pyramid at rest: nothing creeps.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kGroup[] = "rest";
constexpr double kGravity = 9.81;

Scene Pyramid(const std::string& stepping, int base, double duration) {
  Scene scene = NewScene("pyramid", stepping, 0.01, duration);
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i) {
      AddBox(&scene, "box" + std::to_string(row) + "_" + std::to_string(i), 1.0, 1.0, 1.0,
             1.1 * (i + 0.5 * row), row + 0.5);
    }
  }
  AddFloor(&scene);
  return scene;
}

Finding AtRest(Scene scene, Length length, double most_seconds, long gradient_steps,
               const std::string& box) {
  SetMaterial(&scene, 0.5, 0.0);
  double weight = 0.0;
  for (const BasicBody<double>& body : scene.bodies) weight += body.mass * kGravity;
  scene.simulation.duration = length == Length::kLong ? 60.0 : most_seconds;
  double half = 0.0;
  State<double> first;
  const double until = 0.5 * scene.simulation.duration;
  const MeasuredRun run =
      RunScene(scene, [&](long k, double t, const State<double>& state, Stepper*) {
        if (k == 0) first = state;
        if (t > until) return;
        for (size_t i = 0; i < state.pose.size(); ++i) {
          half = std::max(half, std::abs(state.pose[i] - first.pose[i]));
        }
      });
  Finding finding;
  AddDone(run, &finding);
  double floor_impulse = 0.0;
  for (const BasicBody<double>& body : scene.bodies) {
    if (body.motion == Motion::kMoving) floor_impulse += run.NormalImpulse(body.name, "floor");
  }
  finding.figures.push_back(
      {"largest move of a body", run.moved, 1e-6, "m",
       "rest is a solution: what moves is rounding and lcp_tolerance, 1e-10 of g h a step"});
  finding.figures.push_back({"move in the second half beyond the first's",
                             std::max(0.0, run.moved - half), 1e-7, "m", "no creep"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  finding.figures.push_back({"energy change over weight times a side",
                             (run.energy_end - run.energy_start) / weight, 1e-6, "1",
                             "nothing moves"});
  finding.figures.push_back({"error of the impulse on the floor",
                             floor_impulse / (weight * scene.simulation.dt) - 1.0, 1e-8, "1",
                             "it is the weight's"});
  AddGradient(scene, gradient_steps, {"bodies/" + box + "/mass", "gravity/x"}, Differences::kSkip,
              &finding);
  return finding;
}

Scene Stack(const std::string& stepping, int count) {
  Scene scene = NewScene("stack", stepping, 0.01, 1.0);
  AddStack(&scene, std::vector<double>(static_cast<size_t>(count), 1.0));
  return scene;
}

// Two cards lean on each other.
Finding Cards(const std::string& stepping, Length length) {
  Scene scene = NewScene("cards", stepping, 0.01, length == Length::kLong ? 60.0 : 1.0);
  const double lean = 0.3, w = 0.02, h = 1.0;
  for (const double side : {-1.0, 1.0}) {
    // The lowest corner of each stands on the floor, the inner upper corners touch at x = 0.
    const double low = 0.5 * (h * std::cos(lean) + w * std::sin(lean));
    const double inner = 0.5 * (h * std::sin(lean) + w * std::cos(lean));
    AddBox(&scene, side < 0.0 ? "left" : "right", w, h, 1.0, side * inner, low).angle = side * lean;
  }
  AddFloor(&scene);
  SetMaterial(&scene, 0.8, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"largest move of a body", run.moved, 1e-3, "m",
                             "tan 0.3 < 2 mu: they stand; 1e-3 of a card"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  AddGradient(scene, 20, {"bodies/left/mass", "gravity/x"}, Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddResting(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const int count : {10, 50}) {
      cases->push_back({kGroup, "stack of " + std::to_string(count), stepping,
                        [=](Length length) {
                          return AtRest(Stack(stepping, count), length, count < 20 ? 5.0 : 1.0,
                                        count < 20 ? 10 : 3, "box0");
                        },
                        60.0});
    }
    cases->push_back({kGroup, "pyramid, base 20", stepping,
                      [=](Length length) {
                        return AtRest(Pyramid(stepping, 20, 1.0), length,
                                      stepping == "fixed" ? 0.2 : 0.02, 1, "box0_0");
                      },
                      60.0});
    cases->push_back(
        {kGroup, "two cards", stepping, [=](Length length) { return Cards(stepping, length); }});
  }
}

}  // namespace tangible::extremes
