// SPDX-License-Identifier: Apache-2.0
//
// Stacks, pyramids and an arch at rest: they must not creep.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kRestGroup[] = "rest";

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

// A pyramid whose topmost box is heavy.
Scene HeavyTop(const std::string& stepping, double mass) {
  Scene scene = Pyramid(stepping, 10, 1.0);
  for (BasicBody<double>& body : scene.bodies) {
    if (body.name == "box9_0") body.mass = mass;
  }
  return scene;
}

// A box of 20 m and 400 kg on two of 1 m and 1 kg.
Scene HeavyOnTwo(const std::string& stepping) {
  Scene scene = NewScene("heavy on two", stepping, 0.01, 1.0);
  AddBox(&scene, "box0", 1.0, 1.0, 1.0, -9.0, 0.5);
  AddBox(&scene, "box1", 1.0, 1.0, 1.0, 9.0, 0.5);
  AddBox(&scene, "large", 20.0, 20.0, 400.0, 0.0, 11.0);
  AddFloor(&scene);
  return scene;
}

// A half ring of wedges of mean radius 1 m on the floor. Its line of thrust lies within it if it is
// thicker than 0.1075 m (M. Milankovitch, Theorie der Druckkurven, 1907; joints at every angle);
// thinner, no forces balance it and it falls. The wedges are of one density.
Scene Arch(const std::string& stepping, double thickness) {
  constexpr int kWedges = 15;
  Scene scene = NewScene("arch", stepping, 0.01, 1.0);
  const double pi = std::acos(-1.0);
  const double inner = 1.0 - 0.5 * thickness, outer = 1.0 + 0.5 * thickness;
  const double half = 0.5 * pi / kWedges;
  // Of the trapezoid between chords; its centroid is on the bisector.
  const double area = 0.5 * std::sin(2.0 * half) * (outer * outer - inner * inner);
  const double centroid = 2.0 / 3.0 * std::cos(half) *
                          (outer * outer * outer - inner * inner * inner) /
                          (outer * outer - inner * inner);
  const double c = std::cos(half), s = std::sin(half);
  for (int i = 0; i < kWedges; ++i) {
    const double along = (2 * i + 1) * half;
    // In its own frame x points outwards; vertices counterclockwise.
    AddBody(&scene, "wedge" + std::to_string(i),
            {ShapeType::kPolygon,
             {inner * c - centroid, -inner * s, outer * c - centroid, -outer * s,
              outer * c - centroid, outer * s, inner * c - centroid, inner * s}},
            1e3 * area, centroid * std::cos(along), centroid * std::sin(along))
        .angle = along;
  }
  AddFloor(&scene);
  return scene;
}

Finding ArchFalls(const std::string& stepping) {
  Scene scene = Arch(stepping, 0.05);
  SetMaterial(&scene, 0.8, 0.0);
  scene.simulation.duration = 0.2;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"largest move of a body, below 1 cm", std::max(0.0, 0.01 - run.moved),
                             0.0, "m", "0.05 is below Milankovitch's 0.1075: nothing balances it"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-6, "J", "e = 0"});
  AddGradient(scene, 5, {"bodies/wedge7/mass", "gravity/y"}, Differences::kSkip, &finding);
  return finding;
}

// Two cards lean on each other.
Finding Cards(const std::string& stepping, Length length) {
  Scene scene = NewScene("cards", stepping, 0.01, length == Length::kLong ? 60.0 : 1.0);
  const double lean = 0.3, w = 0.02, h = 1.0;
  for (const double side : {-1.0, 1.0}) {
    // The lowest corner of each touches the floor, the inner upper corners touch at x = 0.
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
      cases->push_back({kRestGroup, "stack of " + std::to_string(count), stepping,
                        [=](Length length) {
                          return AtRest(Stack(stepping, count), length, count < 20 ? 5.0 : 1.0,
                                        count < 20 ? 10 : 3, "box0");
                        },
                        60.0});
    }
    cases->push_back({kRestGroup, "pyramid, base 20", stepping,
                      [=](Length length) {
                        return AtRest(Pyramid(stepping, 20, 1.0), length,
                                      stepping == "fixed" ? 0.2 : 0.02, 1, "box0_0");
                      },
                      60.0});
    for (const double mass : {300.0, 1e6}) {
      cases->push_back({kRestGroup,
                        mass < 1e3 ? "pyramid, top of 300 kg" : "pyramid, top of 1e6 kg", stepping,
                        [=](Length length) {
                          return AtRest(HeavyTop(stepping, mass), length,
                                        stepping == "fixed" ? 1.0 : 0.1, 1, "box0_0");
                        },
                        60.0});
    }
    cases->push_back(
        {kRestGroup, "box of 400 kg on two of 1 kg", stepping,
         [=](Length length) { return AtRest(HeavyOnTwo(stepping), length, 5.0, 10, "box0"); },
         60.0});
    cases->push_back(
        {kRestGroup, "arch of 15 wedges, 0.15 thick", stepping,
         [=](Length length) { return AtRest(Arch(stepping, 0.15), length, 1.0, 3, "wedge0"); },
         60.0});
    cases->push_back({kRestGroup, "arch of 15 wedges, 0.05 thick", stepping,
                      [=](Length) { return ArchFalls(stepping); }});
    cases->push_back({kRestGroup, "two cards", stepping,
                      [=](Length length) { return Cards(stepping, length); }});
  }
}

}  // namespace tangible::extremes
