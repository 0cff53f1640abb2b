// SPDX-License-Identifier: Apache-2.0
//
// Restitution 0 and 1 at rest, a ball that bounces infinitely often (Zeno), Newton's cradles.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kRestitutionGroup[] = "restitution";

Finding RestingContacts(const std::string& stepping, double restitution) {
  const double dt = 0.01;
  Scene scene = NewScene("stack", stepping, dt, 2.0);
  AddStack(&scene, {1.0, 1.0, 1.0, 1.0, 1.0});
  SetMaterial(&scene, 0.5, restitution);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"largest speed over g h", run.speed_max / (kGravity * dt), 1e-6, "1",
                             "nothing approaches, so nothing rebounds"});
  finding.figures.push_back({"largest move of a body", run.moved, 1e-6, "m", "they rest"});
  AddGradient(scene, 10, {"bodies/box0/mass", "gravity/x"}, Differences::kTake, &finding);
  return finding;
}

// From 1 m with e = 0.5: heights e^2n, at rest after (1 + e) / (1 - e) sqrt(2 H / g) = 1.354 s.
Finding ZenoBall(const std::string& stepping) {
  const double e = 0.5, radius = 0.1;
  const double stops = (1.0 + e) / (1.0 - e) * std::sqrt(2.0 / kGravity);
  Scene scene = NewScene("bouncing ball", stepping, 0.01, 2.0);
  AddDisc(&scene, "ball", radius, 1.0, 0.0, 1.0 + radius);
  AddFloor(&scene);
  SetMaterial(&scene, 0.0, e);
  double last_motion = 0.0;
  const MeasuredRun run =
      RunScene(scene, [&](long, double t, const State<double>& state, Stepper*) {
        if (std::abs(state.twist[1]) > 1e-9) last_motion = t;
      });
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back(
      {"speed at the end", run.speed_end, 1e-9, "m/s", "it has come to rest"});
  finding.figures.push_back(
      {"height above the floor at the end", run.y("ball") - radius, 1e-9, "m", "it lies on it"});
  // The rebounds below restitution_threshold, 1e-3 m/s, are left out: 2 e / (1 - e) 1e-3 / g s.
  finding.figures.push_back({"error of the time of rest", last_motion - stops,
                             stepping == "fixed" ? kReported : 0.011, "s",
                             stepping == "fixed"
                                 ? "no bound: a fixed step rebounds up to v h above the floor"
                                 : "1.354 s, to a step"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "e < 1"});
  // The gradient covers the first three bounces; the end of the motion is a jump at the threshold.
  AddGradient(scene, 100, {"bodies/ball/restitution", "bodies/ball/position/y", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

Finding ElasticBall(const std::string& stepping, Length length) {
  Scene scene = NewScene("elastic ball", stepping, 0.001, length == Length::kLong ? 100.0 : 5.0);
  AddDisc(&scene, "ball", 0.1, 1.0, 0.0, 1.1);
  AddFloor(&scene);
  SetMaterial(&scene, 0.0, 1.0);
  double peak = 0.0, last_peak = 0.0, height = 0.0, rate = 0.0;
  long bounces = 0;
  const MeasuredRun run = RunScene(scene, [&](long, double, const State<double>& state, Stepper*) {
    if (rate < 0.0 && state.twist[1] > 0.0) ++bounces;
    if (bounces > 0 && rate > 0.0 && state.twist[1] <= 0.0) {
      last_peak = height;
      peak = std::max(peak, height);
    }
    height = state.pose[1] - 0.1;
    rate = state.twist[1];
  });
  Finding finding;
  AddDone(run, &finding);
  // With fixed steps the ball rebounds up to v h above the floor; its energy alternates by
  // m g h v / 2 within a bounce, so heights are compared. Peaks are sampled: within g h^2 / 8 of
  // event steps.
  const bool fixed = stepping == "fixed";
  finding.figures.push_back({"rise of the highest peak over the first height",
                             std::max(0.0, peak - 1.0), fixed ? 1e-3 : 1e-9, "m",
                             "e = 1 adds none"});
  finding.figures.push_back({"change of the last peak a bounce",
                             (last_peak - 1.0) / static_cast<double>(std::max(bounces, 1L)),
                             fixed ? 0.01 : 0.125 * kGravity * 1e-6 + 1e-9, "m",
                             fixed ? "1 % a bounce at h = 1e-3" : "none; g h^2 / 8 of sampling"});
  if (!fixed) {
    finding.figures.push_back({"energy change over m g H",
                               (run.energy_end - run.energy_start) / kGravity, 1e-9, "1",
                               "e = 1 keeps it"});
  }
  AddGradient(scene, 600, {"bodies/ball/position/y", "gravity/y", "bodies/ball/mass"},
              Differences::kTake, &finding);
  return finding;
}

Scene Cradle(const std::string& stepping, int count, double gap) {
  Scene scene = NewScene("cradle", stepping, 0.01, 0.1);
  scene.gravity = {0.0, 0.0};
  for (int i = 0; i < count; ++i) {
    // The first ball flies in and arrives within a step.
    AddDisc(&scene, "ball" + std::to_string(i), 0.1, 1.0, (0.2 + gap) * i - (i == 0 ? 0.005 : 0.0),
            0.0);
  }
  scene.bodies[0].velocity = {1.0, 0.0};
  SetMaterial(&scene, 0.0, 1.0);
  return scene;
}

// Touching balls are one impact: Newton's law gives them one solution, which differs from a
// sequence of impacts.
Finding TouchingCradle(const std::string& stepping) {
  const Scene scene = Cradle(stepping, 3, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double expected[] = {-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0};
  double off = 0.0;
  for (int i = 0; i < 3; ++i) {
    off = std::max(off, std::abs(run.vx("ball" + std::to_string(i)) - expected[i]));
  }
  finding.note =
      "touching balls impact at once by Newton's law: (-1/3, 2/3, 2/3); (0, 0, 1) would be "
      "a sequence of impacts";
  finding.figures.push_back({"error of the velocities (-1/3, 2/3, 2/3)", off, 1e-9, "m/s",
                             "momentum, and e = 1 at each contact that is struck"});
  finding.figures.push_back({"energy change",
                             (run.energy_end - run.energy_start) / run.energy_start, 1e-9, "1",
                             "e = 1 without friction"});
  AddGradient(scene, 10, {"bodies/ball0/velocity/x", "bodies/ball1/mass", "bodies/ball2/mass"},
              Differences::kTake, &finding);
  return finding;
}

// With gaps the impacts occur one after the other.
Finding SpacedCradle(const std::string& stepping, int count) {
  const Scene scene = Cradle(stepping, count, 1e-4);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  double off = std::abs(run.vx("ball" + std::to_string(count - 1)) - 1.0);
  for (int i = 0; i + 1 < count; ++i) {
    off = std::max(off, std::abs(run.vx("ball" + std::to_string(i))));
  }
  finding.figures.push_back(
      {"error of the velocities (0, ..., 0, 1)", off, stepping == "fixed" ? kReported : 1e-9, "m/s",
       stepping == "fixed" ? "no bound: gaps that close within a step are one impact"
                           : "equal masses exchange velocities"});
  finding.figures.push_back({"energy gain over energy", run.energy_gain / run.energy_start, 1e-9,
                             "1", "e = 1 without friction"});
  AddGradient(scene, 10, {"bodies/ball0/velocity/x", "bodies/ball1/mass", "bodies/ball2/mass"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddRestitution(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    cases->push_back({kRestitutionGroup, "stack of 5 at rest, e 0", stepping,
                      [=](Length) { return RestingContacts(stepping, 0.0); }});
    cases->push_back({kRestitutionGroup, "stack of 5 at rest, e 1", stepping,
                      [=](Length) { return RestingContacts(stepping, 1.0); }});
    cases->push_back({kRestitutionGroup, "ball comes to rest (Zeno)", stepping,
                      [=](Length) { return ZenoBall(stepping); }});
    cases->push_back({kRestitutionGroup, "elastic ball", stepping,
                      [=](Length length) { return ElasticBall(stepping, length); }});
    cases->push_back({kRestitutionGroup, "cradle of 3 that touch", stepping,
                      [=](Length) { return TouchingCradle(stepping); }});
    for (const int count : {3, 10}) {
      cases->push_back({kRestitutionGroup, "cradle of " + std::to_string(count) + " with gaps",
                        stepping, [=](Length) { return SpacedCradle(stepping, count); }});
    }
  }
}

}  // namespace tangible::extremes
