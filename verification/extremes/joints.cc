// SPDX-License-Identifier: Apache-2.0
//
// Loops of joints, redundant and contradictory joints, joints at their limits.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kJointsGroup[] = "joints";

// A parallelogram: two cranks of 1 m and a coupler of 2 m; `duplicates` more copies of each hinge.
Scene FourBar(const std::string& stepping, double dt, double duration, int duplicates) {
  Scene scene = NewScene("four-bar", stepping, dt, duration);
  const double lean = 0.6;  // of the cranks, from the vertical
  const double x = std::sin(lean), y = std::cos(lean);
  AddBox(&scene, "crank_a", 0.1, 1.0, 1.0, 0.5 * x, 0.5 * y).angle = -lean;
  AddBox(&scene, "crank_b", 0.1, 1.0, 1.0, 2.0 + 0.5 * x, 0.5 * y).angle = -lean;
  AddBox(&scene, "coupler", 2.0, 0.1, 1.0, 1.0 + x, y);
  for (int copy = 0; copy <= duplicates; ++copy) {
    const std::string suffix = copy > 0 ? "_" + std::to_string(copy) : "";
    AddPin(&scene, "base_a" + suffix, 0, -1, 0.0, 0.0);
    AddPin(&scene, "base_b" + suffix, 1, -1, 2.0, 0.0);
    AddPin(&scene, "top_a" + suffix, 2, 0, x, y);
    AddPin(&scene, "top_b" + suffix, 2, 1, 2.0 + x, y);
  }
  scene.no_contact.emplace_back("*", "*");
  scene.simulation.joint_correction = JointCorrection::kProjection;
  return scene;
}

// It falls through its flat position, where the loop may fold.
Finding FourBarSwings(const std::string& stepping, double dt, Length length) {
  const Scene scene = FourBar(stepping, dt, length == Length::kLong ? 5.0 : 2.0, 0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back(
      {"joint drift", run.joint_drift, 1e-5, "m", "the loop stays closed (projection)"});
  finding.figures.push_back(
      {"energy gain over the kinetic energy", run.energy_gain / run.energy_scale,
       stepping == "fixed" ? kReported : 1e-2, "1",
       stepping == "fixed" ? "no bound: first order in h" : "second order in h"});
  AddGradient(scene, 10, {"bodies/coupler/mass", "gravity/y", "bodies/crank_a/mass"},
              Differences::kTake, &finding);
  return finding;
}

// Duplicated hinges change nothing, neither the motion nor its gradient.
Finding FourBarRedundant(const std::string& stepping) {
  const Scene scene = FourBar(stepping, 0.01, 0.3, 1);
  const MeasuredRun plain = RunScene(FourBar(stepping, 0.01, 0.3, 0));
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  double off = 0.0;
  for (const char* body : {"crank_a", "crank_b", "coupler"}) {
    off =
        std::max({off, std::abs(run.x(body) - plain.x(body)), std::abs(run.y(body) - plain.y(body)),
                  std::abs(run.omega(body) - plain.omega(body))});
  }
  finding.figures.push_back({"difference from single hinges", off, 1e-8, "m, rad/s",
                             "a second hinge in the same place says nothing new"});
  finding.figures.push_back(
      {"joint drift", run.joint_drift, 1e-5, "m", "the loop stays closed (projection)"});
  AddGradient(scene, 10, {"bodies/coupler/mass", "gravity/y", "bodies/crank_a/mass"},
              Differences::kTake, &finding);
  return finding;
}

// A triangle of bars welded together and once more than needed.
Finding WeldedLoop(const std::string& stepping) {
  Scene scene = NewScene("welded loop", stepping, 0.01, 0.5);
  AddBox(&scene, "a", 1.0, 0.1, 1.0, 0.0, 0.0);
  AddBox(&scene, "b", 0.1, 1.0, 1.0, 0.5, 0.5);
  AddBox(&scene, "c", 1.0, 0.1, 1.0, 0.0, 1.0);
  AddBox(&scene, "d", 0.1, 1.0, 1.0, -0.5, 0.5);
  const double corners[4][2] = {{0.5, 0.0}, {0.5, 1.0}, {-0.5, 1.0}, {-0.5, 0.0}};
  for (int i = 0; i < 4; ++i) {
    AddPin(&scene, "weld" + std::to_string(i), i, (i + 1) % 4, corners[i][0], corners[i][1]).type =
        JointType::kWeld;
  }
  scene.bodies[1].velocity = {0.0, 0.0};
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double t = 0.5;
  const double fall = 0.5 * 9.81 * t * (t + (stepping == "fixed" ? 0.01 : 0.0));
  finding.figures.push_back({"error of the fall", run.y("a") + fall, 1e-9, "m", "it falls as one"});
  finding.figures.push_back({"joint drift", run.joint_drift, 1e-9, "m", "nothing strains it"});
  AddGradient(scene, 10, {"bodies/a/mass", "gravity/x", "bodies/c/mass"}, Differences::kTake,
              &finding);
  return finding;
}

// A bar hinged to the world and to a carriage that drives away: no motion exists.
Finding Contradiction(const std::string& stepping) {
  Scene scene = NewScene("contradiction", stepping, 0.01, 0.5);
  AddBox(&scene, "bar", 1.0, 0.1, 1.0, 0.5, 0.0);
  BasicBody<double>& carriage = AddBox(&scene, "carriage", 0.1, 0.1, 1.0, 1.0, 0.0);
  carriage.motion = Motion::kKinematic;
  carriage.mass = 0.0;
  carriage.velocity = {1.0, 0.0};
  AddPin(&scene, "fixed", 0, -1, 0.0, 0.0);
  AddPin(&scene, "moving", 0, 1, 1.0, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  finding.note = run.report.message;
  finding.figures.push_back({"states that are not numbers", run.finite ? 0.0 : 1.0, 0.0, "1",
                             "what fails ends with its last good state"});
  finding.figures.push_back({"runs that are said to be done",
                             run.report.status == StepStatus::kDone ? 1.0 : 0.0, 0.0, "1",
                             "no motion satisfies both hinges"});
  const bool names = run.report.message.find("moving") != std::string::npos ||
                     run.report.message.find("fixed") != std::string::npos;
  finding.figures.push_back({"messages that name neither hinge", names ? 0.0 : 1.0, 0.0, "1",
                             "the status says which joint"});
  return finding;
}

// A pendulum that gravity and a motor push into its stop.
Finding AtLimit(const std::string& stepping, double effort) {
  Scene scene = NewScene("limit", stepping, 0.01, 2.0);
  AddBox(&scene, "arm", 1.0, 0.1, 1.0, 0.5, 0.0);
  BasicJoint<double>& hinge = AddPin(&scene, "hinge", 0, -1, 0.0, 0.0);
  hinge.limits = {{-0.5, 0.5}};
  hinge.effort = -effort;
  scene.simulation.joint_correction = JointCorrection::kProjection;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back(
      {"angle beyond the stop at the end", run.angle("arm") + 0.5, 1e-9, "rad", "it lies at it"});
  finding.figures.push_back({"rate at the end", run.omega("arm"), 1e-9, "rad/s", "it rests"});
  finding.figures.push_back(
      {"penetration of the stop", run.penetration, 1e-4, "rad", "contact_margin"});
  AddGradient(scene, 60, {"bodies/arm/mass", "joints/hinge/limits/0", "joints/hinge/effort"},
              Differences::kTake, &finding);
  return finding;
}

// Both limits in the same place: the joint is locked.
Finding LockedByLimits(const std::string& stepping) {
  Scene scene = NewScene("locked", stepping, 0.01, 1.0);
  AddBox(&scene, "arm", 1.0, 0.1, 1.0, 0.5, 0.0);
  AddPin(&scene, "hinge", 0, -1, 0.0, 0.0).limits = {{0.0, 0.0}};
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"angle at the end", run.angle("arm"), 1e-9, "rad", "it is locked"});
  AddGradient(scene, 10, {"bodies/arm/mass", "gravity/y"}, Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddJoints(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    const auto add = [&](const std::string& name, const std::function<Finding(Length)>& run) {
      cases->push_back({kJointsGroup, name, stepping, run});
    };
    for (const double dt : {0.1, 0.05, 0.01, 0.005}) {
      char text[32];
      std::snprintf(text, sizeof(text), "four-bar loop, h %g", dt);
      add(text, [=](Length length) { return FourBarSwings(stepping, dt, length); });
    }
    add("four-bar loop, hinges twice", [=](Length) { return FourBarRedundant(stepping); });
    add("welded loop falls", [=](Length) { return WeldedLoop(stepping); });
    add("contradictory hinges", [=](Length) { return Contradiction(stepping); });
    add("limit, pushed by gravity", [=](Length) { return AtLimit(stepping, 0.0); });
    add("limit, pushed by 1e6 N m", [=](Length) { return AtLimit(stepping, 1e6); });
    add("limits that lock", [=](Length) { return LockedByLimits(stepping); });
  }
}

}  // namespace tangible::extremes
