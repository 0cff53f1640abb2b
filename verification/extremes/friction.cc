// SPDX-License-Identifier: Apache-2.0
//
// Friction 0, 1, 1e3, 1e12.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kFrictionGroup[] = "friction";

// A disc that spins at 10 rad/s on the floor: it ends at v = ω R / 3 whatever the friction > 0.
Finding SpinningDisc(const std::string& stepping, double friction) {
  Scene scene = NewScene("spinning disc", stepping, 0.01, 1.5);
  AddDisc(&scene, "disc", 1.0, 1.0, 0.0, 1.0).angular_velocity = -10.0;
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double speed = friction > 0.0 ? 10.0 / 3.0 : 0.0;
  const double spin = friction > 0.0 ? -10.0 / 3.0 : -10.0;
  finding.figures.push_back(
      {"error of the speed", run.vx("disc") - speed, 1e-9, "m/s",
       friction > 0.0 ? "w R / 3: angular momentum about the floor" : "nothing acts along x"});
  finding.figures.push_back(
      {"error of the spin", run.omega("disc") - spin, 1e-9, "rad/s", "it rolls, or spins on"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "friction only takes"});
  AddGradient(scene, 100, {"bodies/disc/angular_velocity", "bodies/disc/mass", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

// A wide block with an initial speed: it slides v² / (2 μ g) where friction does not tip it.
Finding SlidingBlock(const std::string& stepping, double friction) {
  const double speed = 2.0, dt = 0.001;
  Scene scene = NewScene("sliding block", stepping, dt, 0.5);
  // With friction up to 1e12 only a block of zero height would not trip: its height is 1e-3 m, so
  // that h / w < 1 / mu for the first two; with more friction an impact stops it at once and may
  // lift it.
  AddBox(&scene, "block", 1.0, 1e-3, 1.0, 0.0, 0.5e-3).velocity = {speed, 0.0};
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  if (friction == 0.0) {
    finding.figures.push_back(
        {"error of the speed", run.vx("block") / speed - 1.0, 1e-12, "1", "nothing acts along x"});
  } else if (friction == 1.0) {
    const double way = 0.5 * speed * speed / (friction * kGravity);
    finding.figures.push_back({"error of the way to rest", run.x("block") / way - 1.0,
                               stepping == "fixed" ? 0.01 : 1e-9, "1",
                               "v^2 / (2 mu g); h v / 2 of it is 0.5 % in fixed steps"});
  } else {
    finding.figures.push_back({"largest move", run.moved, speed * dt + 0.01, "m",
                               "it stops within a step, or trips and falls back"});
  }
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "friction only takes"});
  AddGradient(scene, 60, {"bodies/block/velocity/x", "bodies/block/mass", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

// A block on a slope of 40 degrees: it sticks for mu of at least tan 40°.
Finding Slope(const std::string& stepping, double friction) {
  const double slope = 40.0 * std::atan(1.0) / 45.0, t = 0.5, dt = 0.01;
  Scene scene = NewScene("slope", stepping, dt, t);
  scene.gravity = {kGravity * std::sin(slope), -kGravity * std::cos(slope)};
  AddBox(&scene, "block", 1.0, 0.2, 1.0, 0.0, 0.1);
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double slides = std::max(0.0, kGravity * (std::sin(slope) - friction * std::cos(slope)));
  const double way = 0.5 * slides * t * (t + (stepping == "fixed" ? dt : 0.0));
  finding.figures.push_back({"error of the way", run.x("block") - way, 1e-9, "m",
                             "sticks, or (g sin - mu g cos) t^2 / 2"});
  AddGradient(scene, 50, {"gravity/x", "bodies/block/mass", "bodies/block/velocity/x"},
              Differences::kTake, &finding);
  return finding;
}

// A stack that a force pulls sticks.
Finding PulledStack(const std::string& stepping, double friction) {
  Scene scene = NewScene("pulled stack", stepping, 0.01, 0.5);
  AddStack(&scene, {1.0, 1.0, 1.0, 1.0, 1.0});
  SetMaterial(&scene, friction, 0.0);
  scene.gravity = {0.05 * kGravity, -kGravity};
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double dt = 0.01, t = 0.5;
  const double way =
      friction > 0.0 ? 0.0 : 0.5 * 0.05 * kGravity * t * (t + (stepping == "fixed" ? dt : 0.0));
  finding.figures.push_back(
      {"error of the top's way", run.x("box4") - way, 1e-8, "m",
       friction > 0.0 ? "0.05 is below mu and half a side over the height" : "all slide alike"});
  AddGradient(scene, 10, {"gravity/x", "bodies/box2/mass"}, Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddFriction(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const double friction : {0.0, 1.0, 1e3, 1e12}) {
      char text[32];
      std::snprintf(text, sizeof(text), ", mu %g", friction);
      cases->push_back({kFrictionGroup, std::string("spinning disc") + text, stepping,
                        [=](Length) { return SpinningDisc(stepping, friction); }});
      cases->push_back({kFrictionGroup, std::string("sliding block") + text, stepping,
                        [=](Length) { return SlidingBlock(stepping, friction); }});
      cases->push_back({kFrictionGroup, std::string("slope of 40 degrees") + text, stepping,
                        [=](Length) { return Slope(stepping, friction); }});
      cases->push_back({kFrictionGroup, std::string("pulled stack of 5") + text, stepping,
                        [=](Length) { return PulledStack(stepping, friction); }});
    }
  }
}

}  // namespace tangible::extremes
