// SPDX-License-Identifier: Apache-2.0
//
// Spin at 1e4 rad/s, a million steps of free flight: energy and momentum.

#include <cmath>
#include <string>

#include "tangible/simulation/stepping/invariants.h"
#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kLongRunGroup[] = "long run";
constexpr double kRounding = 2.3e-16;

void AddConserved(const MeasuredRun& run, double steps, Finding* finding) {
  const Vector3<double> before = Momentum(run.model, run.first);
  const Vector3<double> after = Momentum(run.model, run.last);
  // Positions are rounded in every step, and with them angular momentum about the origin.
  const double rounding = 1e-12 + 4.0 * kRounding * steps;
  finding->figures.push_back({"change of energy over energy",
                              (run.energy_end - run.energy_start) / run.energy_start, rounding, "1",
                              "nothing acts: rounding, 4 eps a step"});
  finding->figures.push_back({"change of momentum over momentum",
                              (after - before).head<2>().norm() / before.head<2>().norm(), rounding,
                              "1", "nothing acts: rounding, 4 eps a step"});
  // The error is relative to the parts, which may cancel; the arm grows with the distance.
  const double parts =
      std::hypot(run.x("box"), run.y("box")) * before.head<2>().norm() +
      std::abs(run.omega("box")) * run.model.parameters[run.model.structure->bodies[0].inertia];
  finding->figures.push_back({"change of angular momentum over its parts",
                              (after[2] - before[2]) / parts, rounding, "1",
                              "nothing acts: rounding, 4 eps a step"});
}

Finding FreeFlight(const std::string& stepping, double spin, Length length) {
  const double steps = length == Length::kLong ? 1e6 : 2e4;
  Scene scene = NewScene("free flight", stepping, 1e-3, 1e-3 * steps);
  scene.gravity = {0.0, 0.0};
  BasicBody<double>& box = AddBox(&scene, "box", 1.0, 0.3, 2.0, 0.3, 0.2);
  box.velocity = {0.7, -0.4};
  box.angular_velocity = spin;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  AddConserved(run, steps, &finding);
  AddGradient(scene, 100,
              {"bodies/box/angular_velocity", "bodies/box/mass", "bodies/box/velocity/x"},
              Differences::kTake, &finding);
  return finding;
}

// Two spinning discs joined by a massive bar: momentum with joint forces.
Finding Flywheels(const std::string& stepping, Length length) {
  const double steps = length == Length::kLong ? 1e5 : 2e3;
  Scene scene = NewScene("flywheels", stepping, 1e-4, 1e-4 * steps);
  scene.gravity = {0.0, 0.0};
  AddBox(&scene, "bar", 2.0, 0.1, 1.0, 0.0, 0.0);
  AddDisc(&scene, "left", 0.2, 1.0, -1.0, 0.0).angular_velocity = 1e4;
  AddDisc(&scene, "right", 0.2, 1.0, 1.0, 0.0).angular_velocity = 5e3;
  AddPin(&scene, "left", 1, 0, -1.0, 0.0);
  AddPin(&scene, "right", 2, 0, 1.0, 0.0);
  scene.simulation.joint_correction = JointCorrection::kProjection;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"change of energy over energy",
                             (run.energy_end - run.energy_start) / run.energy_start, 1e-9, "1",
                             "hinges at the centres do no work"});
  finding.figures.push_back({"joint drift", run.joint_drift, 1e-9, "m", "projection"});
  AddGradient(scene, 20, {"bodies/left/angular_velocity", "bodies/bar/mass"}, Differences::kTake,
              &finding);
  return finding;
}

// A disc at 1e4 rad/s lands on a floor: it ends rolling at w R / 3 with any friction.
Finding SpinningDiscLands(const std::string& stepping) {
  const double spin = 1e4, radius = 0.1, friction = 0.5;
  const double slip = spin * radius / (3.0 * friction * 9.81);
  Scene scene = NewScene("spin", stepping, 0.05, 1.1 * slip);
  AddDisc(&scene, "disc", radius, 1.0, 0.0, radius).angular_velocity = -spin;
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double speed = spin * radius / 3.0;
  finding.figures.push_back({"error of the speed at the end", run.vx("disc") / speed - 1.0, 1e-9,
                             "1", "w R / 3: angular momentum about the floor"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  AddGradient(scene, 100, {"bodies/disc/angular_velocity", "bodies/disc/friction", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddLongRuns(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    cases->push_back({kLongRunGroup, "free box, 1e6 steps", stepping,
                      [=](Length length) { return FreeFlight(stepping, 3.0, length); }});
    cases->push_back({kLongRunGroup, "free box at 1e4 rad/s, 1e6 steps", stepping,
                      [=](Length length) { return FreeFlight(stepping, 1e4, length); }});
    cases->push_back({kLongRunGroup, "flywheels at 1e4 rad/s on a bar", stepping,
                      [=](Length length) { return Flywheels(stepping, length); }});
    cases->push_back({kLongRunGroup, "disc at 1e4 rad/s on the floor", stepping,
                      [=](Length) { return SpinningDiscLands(stepping); }});
  }
}

}  // namespace tangible::extremes
