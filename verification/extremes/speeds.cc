// SPDX-License-Identifier: Apache-2.0
//
// Speeds up to 1e4 m/s against a wall of 1 mm: nothing passes through.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kSpeedGroup[] = "speed";
constexpr double kWall = 1e-3;  // m, thickness

enum class Flyer { kDisc, kSpinningBox, kNeedle };

Finding AgainstWall(const std::string& stepping, Flyer flyer, double speed, double restitution) {
  Scene scene = NewScene("wall", stepping, 0.01, 0.1);
  scene.gravity = {0.0, 0.0};
  // A wall at x = 0, the flyer starts so that it hits within the third step.
  const double x = -0.5 - 0.025 * speed;
  BasicBody<double>* body = nullptr;
  if (flyer == Flyer::kDisc) {
    body = &AddDisc(&scene, "flyer", 0.1, 1.0, x, 0.05);
  } else if (flyer == Flyer::kSpinningBox) {
    body = &AddBox(&scene, "flyer", 0.2, 0.2, 1.0, x, 0.05);
    body->angular_velocity = 100.0;
    body->angle = 0.3;
  } else {
    body = &AddBox(&scene, "flyer", 0.2, 1e-3, 1.0, x, 0.05);
    body->angle = 0.2;
  }
  body->velocity = {speed, 0.0};
  AddBox(&scene, "wall", kWall, 1e3, 0.0, 0.0, 0.0).motion = Motion::kStatic;
  SetMaterial(&scene, 0.2, restitution);
  double furthest = -1e300;
  const MeasuredRun run = RunScene(scene, [&](long, double, const State<double>& state, Stepper*) {
    furthest = std::max(furthest, state.pose[0]);
  });
  Finding finding;
  AddDone(run, &finding);
  const bool speculative_box = stepping == "fixed" && flyer != Flyer::kDisc;
  finding.figures.push_back({"furthest centre beyond the wall's middle", std::max(0.0, furthest),
                             speculative_box ? kReported : 0.0, "m",
                             speculative_box ? "no bound: rows are those of the start of the step"
                                             : "nothing goes through"});
  // A box's corner may turn into the wall within a fixed step.
  finding.figures.push_back({"penetration", run.penetration,
                             stepping == "fixed" ? kReported : 1e-9 * (1.0 + 1e-3 * speed), "m",
                             stepping == "fixed" ? "no bound: of first order in h"
                                                 : "the time of an impact to rounding"});
  finding.figures.push_back({"energy gain over energy", run.energy_gain / run.energy_start,
                             flyer == Flyer::kDisc || restitution == 0.0 ? 1e-9 : kReported, "1",
                             "no gain without friction's help (Newton's law)"});
  AddGradient(scene, 10, {"bodies/flyer/velocity/x", "bodies/flyer/mass", "bodies/wall/friction"},
              Differences::kTake, &finding);
  return finding;
}

// Two discs collide head on.
Finding HeadOn(const std::string& stepping, double speed) {
  Scene scene = NewScene("head on", stepping, 0.01, 0.1);
  scene.gravity = {0.0, 0.0};
  AddDisc(&scene, "left", 0.01, 1.0, -0.02 - 0.025 * speed, 0.0).velocity = {speed, 0.0};
  AddDisc(&scene, "right", 0.01, 1.0, 0.02 + 0.025 * speed, 0.0).velocity = {-speed, 0.0};
  SetMaterial(&scene, 0.0, 1.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"way that they passed through each other",
                             std::max(0.0, run.x("left") - run.x("right")), 0.0, "m",
                             "nothing goes through"});
  finding.figures.push_back({"error of the speed after", run.vx("right") / speed - 1.0, 1e-9, "1",
                             "e = 1: they change velocities"});
  AddGradient(scene, 10, {"bodies/left/velocity/x", "bodies/left/mass", "bodies/left/restitution"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddSpeeds(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const int exponent : {1, 2, 3, 4}) {
      const double speed = std::pow(10.0, exponent);
      const std::string at = " at 1e" + std::to_string(exponent) + " m/s";
      for (const double restitution : {0.0, 0.5}) {
        std::string name = "disc" + at;
        name += restitution > 0.0 ? ", e 0.5" : ", e 0";
        cases->push_back({kSpeedGroup, name, stepping, [=](Length) {
                            return AgainstWall(stepping, Flyer::kDisc, speed, restitution);
                          }});
      }
      cases->push_back({kSpeedGroup, "spinning box" + at, stepping, [=](Length) {
                          return AgainstWall(stepping, Flyer::kSpinningBox, speed, 0.0);
                        }});
      cases->push_back({kSpeedGroup, "needle" + at, stepping,
                        [=](Length) { return AgainstWall(stepping, Flyer::kNeedle, speed, 0.0); }});
      cases->push_back({kSpeedGroup, "two discs" + at, stepping,
                        [=](Length) { return HeadOn(stepping, speed); }});
    }
  }
}

}  // namespace tangible::extremes
