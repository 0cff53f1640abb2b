// SPDX-License-Identifier: Apache-2.0
//
// Time steps from 1e-6 to 1 s, lengths and masses from 1e-6 to 1e6, gravity 0 and 1e6.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kScaleGroup[] = "scale";

std::string Short(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", x);
  return text;
}

// Three boxes at rest, and a disc that falls from high above.
Finding TimeStep(const std::string& stepping, double dt) {
  constexpr int kSteps = 50;
  Scene scene = NewScene("time step", stepping, dt, kSteps * dt);
  AddStack(&scene, {1.0, 1.0, 1.0});
  const double height = kGravity * dt * dt * kSteps * kSteps + 10.0;
  AddDisc(&scene, "falls", 0.1, 1.0, 5.0, height);
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double t = scene.simulation.duration;
  const double fallen = height - run.y("falls");
  const double expected =
      0.5 * kGravity * t * t + (stepping == "fixed" ? 0.5 * kGravity * dt * t : 0.0);
  finding.figures.push_back({"error of the fall", (fallen - expected) / expected,
                             1e-9 + 2.0 * 2.3e-16 * kSteps * height / expected, "1",
                             "g t^2 / 2 (+ g h t / 2 of the fixed step); y rounds in every step"});
  double speed = 0.0;
  for (int i = 0; i < 3; ++i) {
    const std::string box = "box" + std::to_string(i);
    speed = std::max(speed, std::hypot(run.vx(box), run.vy(box)));
  }
  finding.figures.push_back(
      {"speed of the boxes over g h", speed / (kGravity * dt), 1e-6, "1", "they rest"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  AddGradient(scene, 20, {"bodies/box1/mass", "gravity/y", "bodies/falls/velocity/x"},
              Differences::kTake, &finding);
  return finding;
}

// A box slides to rest while a disc bounces, all lengths and masses times `scale`; gravity and the
// settings in metres scale with them, so that the motion is the same.
Scene SlideAndBounce(const std::string& stepping, double length, double mass) {
  Scene scene = NewScene("slide and bounce", stepping, 0.01, 0.6);
  scene.gravity *= length;
  AddBox(&scene, "box", length, 0.5 * length, mass, 0.0, 0.25 * length).velocity = {2.0 * length,
                                                                                    0.0};
  BasicBody<double>& ball = AddDisc(&scene, "ball", 0.2 * length, 0.5 * mass, 3.0 * length, length);
  ball.velocity = {0.5 * length, 0.0};
  AddFloor(&scene);
  SetMaterial(&scene, 0.5, 0.0);
  for (BasicBody<double>& body : scene.bodies) {
    if (body.name != "box") body.restitution = 0.6;
  }
  scene.simulation.contact_margin *= length;
  scene.simulation.recovery_speed *= length;
  scene.simulation.restitution_threshold *= length;
  return scene;
}

Finding Rescaled(const std::string& stepping, double length, double mass) {
  const Scene scene = SlideAndBounce(stepping, length, mass);
  const MeasuredRun unit = RunScene(SlideAndBounce(stepping, 1.0, 1.0));
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  double off = 0.0;
  for (const char* body : {"box", "ball"}) {
    off = std::max({off, std::abs(run.x(body) / length - unit.x(body)),
                    std::abs(run.y(body) / length - unit.y(body)),
                    std::abs(run.vx(body) / length - unit.vx(body)),
                    std::abs(run.vy(body) / length - unit.vy(body)),
                    std::abs(run.angle(body) - unit.angle(body))});
  }
  finding.figures.push_back({"difference from the same motion at scale 1", off, 1e-6, "1",
                             "the equations have no scale of their own"});
  AddGradient(scene, 60, {"bodies/box/friction", "bodies/ball/velocity/x", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

// The same sizes with the default settings and g = 9.81: a box slides to rest.
Finding PlainSettings(const std::string& stepping, double size) {
  const double speed = std::sqrt(size), friction = 0.5;
  const double time = speed / (friction * kGravity);
  Scene scene = NewScene("slide", stepping, 0.01 * time, 1.2 * time);
  AddBox(&scene, "box", size, 0.5 * size, size, 0.0, 0.25 * size).velocity = {speed, 0.0};
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double distance = 0.5 * speed * speed / (friction * kGravity);
  finding.figures.push_back(
      {"error of the way to rest", run.x("box") / distance - 1.0,
       stepping == "fixed" ? 0.011 : 1e-9, "1",
       stepping == "fixed" ? "v^2 / (2 mu g); h v / 2 of it is 1 %" : "v^2 / (2 mu g)"});
  finding.figures.push_back({"penetration over the box's size", run.penetration / size, 1e-4, "1",
                             "the default margin at size 1"});
  finding.figures.push_back(
      {"speed at the end over the first", run.speed_end / speed, 1e-9, "1", "it rests"});
  AddGradient(scene, 60, {"bodies/box/velocity/x", "bodies/floor/friction", "bodies/box/mass"},
              Differences::kTake, &finding);
  return finding;
}

Finding NoGravity(const std::string& stepping) {
  Scene scene = NewScene("no gravity", stepping, 0.01, 1.0);
  scene.gravity = {0.0, 0.0};
  AddStack(&scene, {1.0, 1.0, 1.0});
  AddDisc(&scene, "free", 0.1, 1.0, 5.0, 3.0).velocity = {3.0, -0.5};
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"error of the flight",
                             std::hypot(run.x("free") - 8.0, run.y("free") - 2.5), 1e-12, "m",
                             "v t; rounding of 100 steps"});
  finding.figures.push_back({"move of touching boxes",
                             std::hypot(run.x("box2"), run.y("box2") - 2.5), 0.0, "m",
                             "nothing acts on them"});
  AddGradient(scene, 20, {"bodies/free/velocity/x", "bodies/box1/mass", "bodies/box1/velocity/x"},
              Differences::kTake, &finding);
  return finding;
}

Finding HugeGravity(const std::string& stepping) {
  Scene scene = NewScene("huge gravity", stepping, 0.001, 0.5);
  scene.gravity = {0.0, -1e6};
  AddStack(&scene, {1.0, 1.0, 1.0});
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back(
      {"speed at the end over g h", run.speed_end / 1e3, 1e-6, "1", "they rest"});
  finding.figures.push_back({"largest move of a body", run.moved, 1e-4, "m", "contact_margin"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  AddGradient(scene, 20, {"gravity/x", "gravity/y", "bodies/box1/mass"}, Differences::kTake,
              &finding);
  return finding;
}

}  // namespace

void AddScales(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const double dt : {1e-6, 1e-4, 1e-1, 1.0}) {
      cases->push_back({kScaleGroup, "dt " + Short(dt) + " s", stepping,
                        [=](Length) { return TimeStep(stepping, dt); }});
    }
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
      cases->push_back({kScaleGroup, "m, kg, g and settings times " + Short(scale), stepping,
                        [=](Length) { return Rescaled(stepping, scale, scale); }});
      cases->push_back({kScaleGroup, "box of " + Short(scale) + " m and kg slides", stepping,
                        [=](Length) { return PlainSettings(stepping, scale); }});
    }
    cases->push_back(
        {kScaleGroup, "gravity 0", stepping, [=](Length) { return NoGravity(stepping); }});
    cases->push_back(
        {kScaleGroup, "gravity 1e6", stepping, [=](Length) { return HugeGravity(stepping); }});
  }
}

}  // namespace tangible::extremes
