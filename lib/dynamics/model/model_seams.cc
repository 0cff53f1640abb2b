// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model_seams.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/geometry/broad_phase.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

bool HasOutline(const Model<double>& model, int body) {
  return model.structure->bodies[body].shape == ShapeType::kPolyline ||
         IsConcavePolygon(model.Shape(body));
}

bool MoveAlike(const State<double>& state, int a, int b) {
  return std::equal(&state.twist[3 * a], &state.twist[3 * a] + 3, &state.twist[3 * b]) &&
         (state.twist[3 * a + 2] == 0.0);
}

// Whether whatever touches one of two bodies may touch the other one too. Only then one of them
// hides what is inside of both.
bool TouchTheSame(const ModelStructure& structure, int a, int b) {
  if (structure.no_contact.empty() && structure.joined.empty()) {
    return true;
  }
  return std::all_of(structure.moving.begin(), structure.moving.end(), [&](int body) {
    return !structure.bodies[body].HasContacts() ||
           structure.MayCollide(body, a) == structure.MayCollide(body, b);
  });
}

// The box in which a shape may be a neighbour: behind a line that is open everything is solid, of
// which the next of its own length counts.
Aabb BoxOfNeighbour(const ShapeView<double>& shape, const Pose<double>& pose, bool is_open_line) {
  const double rounding = kSeamRounding * pose.position.cwiseAbs().maxCoeff();
  const Aabb box = ComputeAabb(shape, pose, kFlushStep + rounding);
  if (!is_open_line) return box;
  const double length = std::max(box.max_x - box.min_x, box.max_y - box.min_y);
  return {box.min_x - length, box.min_y - length, box.max_x + length, box.max_y + length};
}

// The pairs of bodies that touch, or may lie behind an open line, and keep their places relative to
// each other.
std::vector<std::pair<int, int>> FindNeighbours(const Model<double>& model,
                                                const State<double>& state,
                                                const std::vector<bool>& may_have_seams,
                                                const std::vector<bool>& are_open_lines) {
  const ModelStructure& structure = *model.structure;
  std::vector<Aabb> boxes(structure.bodies.size(), {kInfinity, kInfinity, -kInfinity, -kInfinity});
  for (int body = 0; body < structure.num_bodies(); ++body) {
    if (may_have_seams[body]) {
      boxes[body] = BoxOfNeighbour(model.Shape(body), state.PoseOf(body), are_open_lines[body]);
    }
  }
  std::vector<std::pair<int, int>> pairs;
  BroadPhase().FindPairs(
      boxes,
      [&](int a, int b) {
        return may_have_seams[a] && may_have_seams[b] && PathOfBody(structure, a) < 0 &&
               PathOfBody(structure, b) < 0 && MoveAlike(state, a, b) &&
               TouchTheSame(structure, a, b);
      },
      &pairs);
  return pairs;
}

}  // namespace

void FindModelSeams(const State<double>& state, Model<double>* model) {
  model->seams = nullptr;
  model->seams_of.clear();
  model->outline_of.clear();
  model->curve_of.clear();
  const ModelStructure& structure = *model->structure;
  std::vector<bool> may_have_seams(structure.bodies.size(), false);
  std::vector<bool> are_open_lines(structure.bodies.size(), false);
  int count = 0;
  ModelSeams seams;
  std::vector<int> seams_of(structure.bodies.size(), -1);
  std::vector<int> outline_of(structure.bodies.size(), -1);
  std::vector<int> curve_of(structure.bodies.size(), -1);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const BodyIndex& index = structure.bodies[body];
    if (index.shape == ShapeType::kNone) continue;
    if (index.shape == ShapeType::kSpline) {
      curve_of[body] = static_cast<int>(seams.curves.size());
      seams.curves.emplace_back(model->Shape(body));
      continue;
    }
    if (HasOutline(*model, body)) {
      outline_of[body] = static_cast<int>(seams.outlines.size());
      const Outline& outline = seams.outlines.emplace_back(model->Shape(body));
      are_open_lines[body] = outline.Next(outline.num_runs() - 1) < 0;
    }
    if (index.block < 0 && MayHaveSeams(model->Shape(body))) {
      may_have_seams[body] = true;
      ++count;
    }
  }
  if (count < 2 && seams.outlines.empty() && seams.curves.empty()) {
    return;
  }
  std::vector<std::vector<PlacedShape>> neighbours(structure.bodies.size());
  const auto placed = [&](int body) -> PlacedShape {
    return {model->Shape(body), state.PoseOf(body),
            outline_of[body] < 0 ? nullptr : &seams.outlines[outline_of[body]]};
  };
  for (const auto& [a, b] : FindNeighbours(*model, state, may_have_seams, are_open_lines)) {
    neighbours[a].push_back(placed(b));
    neighbours[b].push_back(placed(a));
  }
  // What an outline leaves of its neighbours does not depend on what they leave of it.
  std::vector<std::pair<int, ShapeSeams>> of_outlines;
  for (int body = 0; body < structure.num_bodies(); ++body) {
    ShapeSeams own;
    if (neighbours[body].empty() || structure.bodies[body].shape == ShapeType::kHalfPlane ||
        !FindSeams(placed(body), neighbours[body], &own, &seams.steps)) {
      continue;
    }
    if (outline_of[body] >= 0) {
      of_outlines.emplace_back(outline_of[body], std::move(own));
      continue;
    }
    seams_of[body] = static_cast<int>(seams.shapes.size());
    seams.shapes.push_back(std::move(own));
  }
  for (auto& [outline, own] : of_outlines) {
    seams.outlines[outline].SetSeams(std::move(own));
  }
  if (!seams.shapes.empty() || !seams.outlines.empty() || !seams.curves.empty()) {
    model->seams = std::make_shared<const ModelSeams>(std::move(seams));
    model->seams_of = std::move(seams_of);
    model->outline_of = std::move(outline_of);
    model->curve_of = std::move(curve_of);
  }
}

}  // namespace tangible
