// SPDX-License-Identifier: Apache-2.0
//
// Deep overlaps, coincident centres, corners on corners, slivers, sizes 1e9 apart.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/simulation/stepping/invariants.h"
#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kGeometryGroup[] = "geometry";

// Two bodies that overlap, without gravity: they separate no faster than recovery_speed.
Finding Part(Scene scene, const std::vector<std::string>& parameters) {
  scene.gravity = {0.0, 0.0};
  scene.simulation.duration = 1.0;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"overlap at the end", DeepestPenetration(run.model, run.last), 1e-6,
                             "m", "recovery_speed parts them within the run"});
  finding.figures.push_back({"largest speed over recovery_speed", run.speed_max / 3.0, 1.0 + 1e-9,
                             "1", "recovery_speed bounds how fast"});
  AddGradient(scene, 20, parameters, Differences::kTake, &finding);
  return finding;
}

Scene TwoBoxes(const std::string& stepping, double width, double x, double y) {
  Scene scene = NewScene("overlap", stepping, 0.01, 1.0);
  AddBox(&scene, "a", 1.0, 1.0, 1.0, 0.0, 0.0);
  AddBox(&scene, "b", width, width, 1.0, x, y);
  SetMaterial(&scene, 0.3, 0.0);
  return scene;
}

Scene TwoDiscs(const std::string& stepping, double x) {
  Scene scene = NewScene("discs", stepping, 0.01, 1.0);
  AddDisc(&scene, "a", 0.5, 1.0, 0.0, 0.0);
  AddDisc(&scene, "b", 0.3, 1.0, x, 0.0);
  SetMaterial(&scene, 0.3, 0.0);
  return scene;
}

// A scene on the floor for a second; it should not move.
Finding Rests(const Scene& scene, double bound, const std::string& reason,
              const std::vector<std::string>& parameters) {
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"largest move of a body", run.moved, bound, "m", reason});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  AddGradient(scene, 20, parameters, Differences::kTake, &finding);
  return finding;
}

Finding Sliver(const std::string& stepping, double thickness) {
  Scene scene = NewScene("sliver", stepping, 0.01, 1.0);
  // A triangle of base 1 m; its centroid is a third of its height above the base.
  AddBody(&scene, "sliver",
          {ShapeType::kPolygon,
           {-0.5, -thickness / 3.0, 0.5, -thickness / 3.0, 0.0, 2.0 * thickness / 3.0}},
          1.0, 0.0, thickness / 3.0);
  AddFloor(&scene);
  SetMaterial(&scene, 0.5, 0.0);
  return Rests(scene, 1e-9, "it lies on its base",
               {"bodies/sliver/mass", "gravity/x", "bodies/sliver/velocity/x"});
}

// A needle that falls flat, inclined, onto the floor and lies there.
Finding Needle(const std::string& stepping, double thickness) {
  Scene scene = NewScene("needle", stepping, 0.005, 1.5);
  BasicBody<double>& needle = AddBox(&scene, "needle", 1.0, thickness, 1.0, 0.0, 0.4);
  needle.angle = 0.3;
  AddFloor(&scene);
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"angle at the end", run.angle("needle"), 1e-6, "rad", "it lies flat"});
  finding.figures.push_back({"height of its centre beyond half its thickness",
                             run.y("needle") - 0.5 * thickness, 1e-6, "m", "it lies flat"});
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "e = 0"});
  AddGradient(scene, 60, {"bodies/needle/mass", "bodies/needle/angle", "bodies/floor/friction"},
              Differences::kTake, &finding);
  return finding;
}

// A disc of 1e-6 m on the floor, beside one of 1e3 m.
Finding SmallBesideLarge(const std::string& stepping) {
  Scene scene = NewScene("discs", stepping, 0.01, 1.0);
  AddDisc(&scene, "large", 1e3, 1e9, 0.0, 1e3);
  // The small disc touches neither the large one nor the inside of the floor: x exceeds
  // 2 sqrt(R r).
  AddDisc(&scene, "small", 1e-6, 1e-9, 0.1, 1e-6);
  AddFloor(&scene);
  SetMaterial(&scene, 0.5, 0.0);
  return Rests(scene, 1e-9, "both lie on the floor",
               {"bodies/large/mass", "bodies/small/mass", "gravity/x"});
}

// The small one rolls over the large one's top, where it would rest in an unstable balance.
Finding SmallOnLarge(const std::string& stepping) {
  Scene scene = NewScene("discs", stepping, 0.01, 0.5);
  BasicBody<double>& large = AddDisc(&scene, "large", 1e3, 0.0, 0.0, -1e3);
  large.motion = Motion::kStatic;
  AddDisc(&scene, "small", 1e-6, 1e-9, 0.0, 1e-6);
  SetMaterial(&scene, 0.5, 0.0);
  return Rests(scene, 1e-9, "it balances exactly",
               {"bodies/small/mass", "gravity/y", "bodies/small/velocity/x"});
}

// A square balances on its corner, upon the corner of another.
Finding CornerOnCorner(const std::string& stepping) {
  Scene scene = NewScene("corners", stepping, 0.01, 0.2);
  const double half = std::sqrt(0.5);
  BasicBody<double>& lower = AddBox(&scene, "lower", 1.0, 1.0, 0.0, 0.0, -half);
  lower.motion = Motion::kStatic;
  lower.angle = std::atan(1.0);
  AddBox(&scene, "upper", 1.0, 1.0, 1.0, 0.0, half).angle = std::atan(1.0);
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.note = "corner " + std::to_string(run.x("upper")) + ", " +
                 std::to_string(run.y("upper") - half) + " m from its start";
  finding.figures.push_back({"energy gain", run.energy_gain, 1e-9, "J", "e = 0"});
  // A fixed step moves a corner that turns by (v h)² / r off its row: 1e-4 m at 1 m/s.
  finding.figures.push_back(
      {"penetration", run.penetration, stepping == "fixed" ? 2e-4 : 1e-4, "m",
       stepping == "fixed" ? "contact_margin, and (v h)^2 / r of a step" : "contact_margin"});
  // The square may tip or slide, but no faster than in free fall.
  finding.figures.push_back({"largest speed over that of free fall", run.speed_max / (9.81 * 0.2),
                             1.0 + 1e-9, "1", "gravity alone"});
  AddGradient(scene, 10, {"bodies/upper/mass", "gravity/y", "bodies/upper/velocity/x"},
              Differences::kTake, &finding);
  return finding;
}

// A box slides over forty flush tiles, in a frame that is turned by `tilt`: corner meets corner at
// every seam, up to rounding.
Finding FlushTiles(const std::string& stepping, double tilt) {
  constexpr double kSpeed = 2.0;
  constexpr double kTile = 0.1;
  constexpr int kTiles = 40;
  const double c = std::cos(tilt);
  const double s = std::sin(tilt);
  Scene scene = NewScene("tiles", stepping, 0.01, 1.0);
  scene.gravity = {9.81 * s, -9.81 * c};
  const auto place = [&](BasicBody<double>* body, double x, double y) {
    body->position = {c * x - s * y, s * x + c * y};
    body->angle = tilt;
  };
  BasicBody<double>& box = AddBox(&scene, "box", 0.3, 0.2, 1.0, 0.0, 0.0);
  place(&box, 0.5, 0.1);
  box.velocity = {c * kSpeed, s * kSpeed};
  for (int i = 0; i < kTiles; ++i) {
    BasicBody<double>& tile = AddBox(&scene, "tile" + std::to_string(i), kTile, 0.1, 0.0, 0.0, 0.0);
    tile.motion = Motion::kStatic;
    place(&tile, (i + 0.5) * kTile, -0.05);
  }
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back({"speed lost, of that along the tiles",
                             1.0 - (c * run.vx("box") + s * run.vy("box")) / kSpeed, 1e-9, "1",
                             "no friction, and no edge in the way"});
  finding.figures.push_back({"height above the tiles", c * run.y("box") - s * run.x("box") - 0.1,
                             1e-9, "m", "it stays on them"});
  AddGradient(scene, 40, {"bodies/box/mass", "bodies/box/velocity/x", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddGeometry(std::vector<ExtremeCase>* cases) {
  const std::vector<std::string> pair = {"bodies/a/mass", "bodies/b/position/x",
                                         "bodies/a/friction"};
  for (const std::string stepping : kSteppings) {
    const auto add = [&](const std::string& name, const std::function<Finding()>& run) {
      cases->push_back({kGeometryGroup, name, stepping, [run](Length) { return run(); }});
    };
    add("boxes half in each other", [=] { return Part(TwoBoxes(stepping, 1.0, 0.5, 0.01), pair); });
    add("box inside a box", [=] { return Part(TwoBoxes(stepping, 0.2, 0.1, 0.03), pair); });
    add("boxes in the same place", [=] { return Part(TwoBoxes(stepping, 1.0, 0.0, 0.0), pair); });
    add("discs with one centre", [=] { return Part(TwoDiscs(stepping, 0.0), pair); });
    add("discs, centres 1e-12 m apart", [=] { return Part(TwoDiscs(stepping, 1e-12), pair); });
    add("corner on corner", [=] { return CornerOnCorner(stepping); });
    add("box slides over flush tiles", [=] { return FlushTiles(stepping, 0.0); });
    add("box slides over flush tiles, turned", [=] { return FlushTiles(stepping, 0.3); });
    for (const double thickness : {1e-3, 1e-6, 1e-9}) {
      char text[32];
      std::snprintf(text, sizeof(text), "%g m", thickness);
      add(std::string("sliver of ") + text + " lies", [=] { return Sliver(stepping, thickness); });
      add(std::string("needle of ") + text + " falls", [=] { return Needle(stepping, thickness); });
    }
    add("disc 1e-6 m beside 1e3 m", [=] { return SmallBesideLarge(stepping); });
    add("disc 1e-6 m on top of 1e3 m", [=] { return SmallOnLarge(stepping); });
  }
}

}  // namespace tangible::extremes
