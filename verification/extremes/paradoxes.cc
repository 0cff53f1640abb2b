// SPDX-License-Identifier: Apache-2.0
//
// Painlevé's rod, wedged and jammed bodies: contact problems without a solution in accelerations,
// or with several.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kParadoxGroup[] = "paradox";

std::string Twist(const MeasuredRun& run, const std::string& body) {
  char text[120];
  std::snprintf(text, sizeof(text), "(%.6f, %.6f, %.6f)", run.vx(body), run.vy(body),
                run.omega(body));
  return text;
}

// A rod of half length 1, mass 1, inertia 1/3 whose lower left end touches the floor; cos 3/5, sin
// 4/5. Its tip moves at (tip_speed, 0).
Scene Rod(const std::string& stepping, double h, double friction, double tip_speed, double omega) {
  Scene scene = NewScene("rod", stepping, h, h);
  const double c = 0.6, s = 0.8;
  BasicBody<double>& rod =
      AddBody(&scene, "rod", {ShapeType::kPolygon, {-1.0, 0.0, 0.0, -0.01, 1.0, 0.0, 0.0, 0.01}},
              1.0, 0.0, s);
  rod.inertia = 1.0 / 3.0;
  rod.angle = std::atan2(s, c);
  rod.angular_velocity = omega;
  rod.velocity = {tip_speed - omega * s, omega * c};  // the tip is at (-c, -s)
  AddFloor(&scene);
  SetMaterial(&scene, friction, 0.0);
  return scene;
}

// The tip stops at once ("impact without collision"): both impulses from W λ = −u, u the tip's
// velocity without them.
Finding RodSticks(const std::string& stepping, double h, double friction) {
  const Scene scene = Rod(stepping, h, friction, -1.0, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double wnn = 1.0 + 3.0 * 0.36, wtt = 1.0 + 3.0 * 0.64, wnt = -3.0 * 0.48;
  const double g_h = stepping == "fixed" ? kGravity * h : 0.0;
  const double det = wnn * wtt - wnt * wnt;
  const double n = (wtt * g_h - wnt) / det, t = (wnn - wnt * g_h) / det;
  const double expected[] = {-1.0 + t, n - g_h, 3.0 * (0.8 * t - 0.6 * n)};
  const double off =
      std::max({std::abs(run.vx("rod") - expected[0]), std::abs(run.vy("rod") - expected[1]),
                std::abs(run.omega("rod") - expected[2])});
  finding.note = "inconsistent: no acceleration exists; the tip stops by an impulse, twist " +
                 Twist(run, "rod");
  finding.figures.push_back({"error of the twist after", off,
                             stepping == "fixed" ? 1e-8 : 1e-8 + 30.0 * h, "m/s",
                             stepping == "fixed" ? "the step's exact solution"
                                                 : "the same for h -> 0, and h of motion after"});
  finding.figures.push_back(
      {"energy gain", run.energy_gain, 1e-9, "J", "an impulse that stops the tip takes energy"});
  AddGradient(scene, 1, {"bodies/rod/velocity/x", "bodies/rod/mass", "bodies/rod/inertia"},
              Differences::kTake, &finding);
  return finding;
}

// mu = 1.3: no paradox, an ordinary impulse of order h.
Finding RodSlides(const std::string& stepping) {
  const double h = 1e-6;
  const Scene scene = Rod(stepping, h, 1.3, -1.0, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double force = kGravity / (1.0 + 3.0 * 0.6 * (0.6 - 1.3 * 0.8));
  finding.figures.push_back({"error of the normal force",
                             run.NormalImpulse("rod", "floor") / h / force - 1.0, 1e-4, "1",
                             "g / (1 + 3 c (c - mu s)), to order h"});
  AddGradient(scene, 1, {"bodies/rod/velocity/x", "bodies/rod/mass", "bodies/floor/friction"},
              Differences::kTake, &finding);
  return finding;
}

// omega = 4: lift-off (N = 0), N = 3.7375, and an impact are all solutions.
Finding RodIndeterminate(const std::string& stepping) {
  const double h = 1e-6;
  const Scene scene = Rod(stepping, h, 2.0, -1.0, 4.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double lifts = std::abs(run.vx("rod") + 4.2) + std::abs(run.vy("rod") - 2.4) +
                       std::abs(run.omega("rod") - 4.0);
  const double tip_x = run.vx("rod") + 0.8 * run.omega("rod");
  const bool flies = lifts < 1e-3, stops = std::abs(tip_x) < 1e-3;
  finding.note = "indeterminate: " +
                 std::string(flies ? "lifts off, as no impulse is needed and the tip accelerates up"
                             : stops ? "the tip stops by an impulse, as a velocity step sees g h "
                                       "but not the curvature that lifts the tip"
                                     : "neither") +
                 "; twist " + Twist(run, "rod");
  finding.figures.push_back({"distance from each of the solutions (0: is one)",
                             flies || stops ? 0.0 : 1.0, 0.0, "1",
                             "lift-off or impact, nothing between"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-4, "J", "an impulse takes energy"});
  AddGradient(scene, 1, {"bodies/rod/velocity/x", "bodies/rod/mass", "bodies/rod/inertia"},
              Differences::kTake, &finding);
  return finding;
}

// Half length 1/2, inertia 1, 45 degrees, mu = 1000: a published example of the paradox.
Finding RodOfLargeFriction(const std::string& stepping) {
  const double h = 0.01, a = std::sqrt(0.125);
  Scene scene = NewScene("rod", stepping, h, h);
  BasicBody<double>& rod =
      AddBody(&scene, "rod", {ShapeType::kPolygon, {-0.5, 0.0, 0.0, -0.01, 0.5, 0.0, 0.0, 0.01}},
              1.0, 0.0, a);
  rod.inertia = 1.0;
  rod.angle = std::atan(1.0);
  rod.velocity = {-1.0, 0.0};
  AddFloor(&scene);
  SetMaterial(&scene, 1e3, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double off = std::max({std::abs(run.vx("rod") + 0.09019), std::abs(run.vy("rod") - 0.09019),
                               std::abs(run.omega("rod") - 0.2550958423808589)});
  finding.note = "twist " + Twist(run, "rod");
  finding.figures.push_back(
      {"error of the twist after", off, stepping == "fixed" ? 1e-8 : kGravity * h, "m/s",
       stepping == "fixed" ? "the step's exact solution" : "the same but for a step's gravity"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "an impulse takes energy"});
  AddGradient(scene, 1, {"bodies/rod/velocity/x", "bodies/rod/mass", "bodies/rod/inertia"},
              Differences::kTake, &finding);
  return finding;
}

// A body exactly between two walls: with friction it may fall or be jammed.
Finding Jammed(const std::string& stepping, bool disc, double friction) {
  const double h = 0.01;
  Scene scene = NewScene("jam", stepping, h, 0.1);
  if (disc) {
    AddDisc(&scene, "body", 0.5, 1.0, 0.0, 0.0);
  } else {
    AddBox(&scene, "body", 1.0, 1.0, 1.0, 0.0, 0.0);
  }
  AddBox(&scene, "left", 1.0, 10.0, 0.0, -1.0, 0.0).motion = Motion::kStatic;
  AddBox(&scene, "right", 1.0, 10.0, 0.0, 1.0, 0.0).motion = Motion::kStatic;
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double falls = std::abs(run.vy("body") + kGravity * 0.1);
  const double jams = std::abs(run.vy("body"));
  finding.note = std::string(jams < 1e-9    ? "jams: the walls press and hold it"
                             : falls < 1e-9 ? "falls: no impulse is needed, so none is taken"
                                            : "neither") +
                 "; twist " + Twist(run, "body");
  finding.figures.push_back({"distance from the nearer solution", std::min(falls, jams), 1e-9,
                             "m/s", "it falls freely or is jammed"});
  const double impulse = std::abs(run.NormalImpulse("body", "left"));
  finding.figures.push_back({"impulse of a wall over m g h", impulse / (kGravity * h), 1e3, "1",
                             "any above 1 / (2 mu) would do; not without limit"});
  AddGradient(scene, 5, {"bodies/body/mass", "gravity/y", "bodies/body/velocity/y"},
              Differences::kTake, &finding);
  return finding;
}

// A disc in a groove of 90 degrees.
Finding Groove(const std::string& stepping, double friction) {
  const double h = 0.01, a = std::sqrt(0.5);
  Scene scene = NewScene("groove", stepping, h, 0.5);
  AddDisc(&scene, "disc", 0.5, 1.0, 0.0, 0.5 / a);
  for (const double side : {-1.0, 1.0}) {
    AddBody(&scene, side < 0.0 ? "left" : "right", {ShapeType::kHalfPlane, {-side * a, a, 0.0}},
            0.0, 0.0, 0.0)
        .motion = Motion::kStatic;
  }
  SetMaterial(&scene, friction, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"largest move", run.moved, 1e-9, "m", "it lies in the groove"});
  const double impulse = run.NormalImpulse("disc", "left");
  finding.figures.push_back({"impulse of a side over m g h", impulse / (kGravity * h), 1e3, "1",
                             "hyperstatic with friction: bounded, any of many"});
  finding.note = "impulse of a side " + std::to_string(impulse / (kGravity * h)) + " m g h; " +
                 (friction > 0.0 ? "any n with n + t = 0.707107, |t| <= mu n balances: taken are "
                                   "the impulses nearest to the step before's, from 0 in the first"
                                 : "the only one without friction");
  AddGradient(scene, 10, {"bodies/disc/mass", "gravity/x", "bodies/disc/velocity/y"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddParadoxes(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    const auto add = [&](const std::string& name, const std::function<Finding()>& run) {
      cases->push_back({kParadoxGroup, name, stepping, [run](Length) { return run(); }});
    };
    add("Painleve, inconsistent, h 1e-2", [=] { return RodSticks(stepping, 1e-2, 2.0); });
    add("Painleve, inconsistent, h 1e-6", [=] { return RodSticks(stepping, 1e-6, 2.0); });
    add("Painleve, inconsistent, h 1e-9", [=] { return RodSticks(stepping, 1e-9, 2.0); });
    add("Painleve, mu 1.3: none", [=] { return RodSlides(stepping); });
    add("Painleve, indeterminate", [=] { return RodIndeterminate(stepping); });
    add("Painleve, mu 1e3", [=] { return RodOfLargeFriction(stepping); });
    for (const double friction : {0.0, 1.0, 1e6}) {
      char text[32];
      std::snprintf(text, sizeof(text), ", mu %g", friction);
      add(std::string("disc between walls") + text,
          [=] { return Jammed(stepping, true, friction); });
      add(std::string("box between walls") + text,
          [=] { return Jammed(stepping, false, friction); });
    }
    for (const double friction : {0.0, 0.5, 2.0}) {
      char text[32];
      std::snprintf(text, sizeof(text), ", mu %g", friction);
      add(std::string("disc in a groove") + text, [=] { return Groove(stepping, friction); });
    }
  }
}

}  // namespace tangible::extremes
