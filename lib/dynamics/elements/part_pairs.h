// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The parts of two bodies that may touch: of an outline (a polyline or concave polygon) the runs
// that are near the other body, which its tree finds.

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/model.h"
#include "tangible/geometry/broad_phase.h"

namespace tangible {

/// The box, in a body's frame, of a box of the world that is grown by `margin`. That of an open
/// polyline has no end.
inline Aabb BoxInFrame(const Pose<double>& frame, const Aabb& box, double margin) {
  if (std::isinf(box.max_x - box.min_x) || std::isinf(box.max_y - box.min_y)) return box;
  const Vector2<double> centre(0.5 * (box.min_x + box.max_x), 0.5 * (box.min_y + box.max_y));
  const double half_x = 0.5 * (box.max_x - box.min_x);
  const double half_y = 0.5 * (box.max_y - box.min_y);
  const double c = std::abs(frame.rotation.cosine);
  const double s = std::abs(frame.rotation.sine);
  const Vector2<double> at = frame.Inverse(centre);
  const double x = c * half_x + s * half_y + margin;
  const double y = s * half_x + c * half_y + margin;
  return {at.x() - x, at.y() - y, at.x() + x, at.y() + y};
}

/// The run of an outline that is nearest to a point of its frame if the point is behind it; else
/// −1. Boxes about the point are doubled from `size` until they hold a run.
inline int RunBefore(const Outline& outline, const Vector2<double>& x, double size) {
  int nearest = -1;
  double best = std::numeric_limits<double>::infinity();
  const auto look = [&](double half) {
    outline.ForEachRun({x.x() - half, x.y() - half, x.x() + half, x.y() + half}, [&](int i) {
      const OutlineRun& run = outline.run(i);
      const double s = std::clamp(run.tangent.dot(x - run.start), 0.0, run.length);
      const double distance = (x - run.start - s * run.tangent).norm();
      if (distance < best) {
        best = distance;
        nearest = i;
      }
    });
  };
  for (double half = size; nearest < 0 && std::isfinite(half); half *= 2.0) look(half);
  if (nearest < 0) return -1;
  look(best);
  const OutlineRun& run = outline.run(nearest);
  return run.normal.dot(x - run.start) < 0.0 ? nearest : -1;
}

/// Calls visit(run) for the runs that a box overlaps. A box that no run is near is in the solid
/// where it is behind the nearest run, which then is its only one.
template <typename Visit>
void ForEachRunNear(const Outline& outline, const Aabb& box, const Visit& visit) {
  bool is_near = false;
  outline.ForEachRun(box, [&](int run) {
    is_near = true;
    visit(run);
  });
  if (is_near) return;
  const Vector2<double> centre(0.5 * (box.min_x + box.max_x), 0.5 * (box.min_y + box.max_y));
  const double size = 0.5 * std::max(box.max_x - box.min_x, box.max_y - box.min_y);
  const int run = size > 0.0 ? RunBefore(outline, centre, size) : -1;
  if (run >= 0) visit(run);
}

/// Calls visit(PartPair) for the parts of two bodies that may touch, as
/// ModelStructure::ForEachPartPair. The boxes are grown by how far each body may go; `reach` says
/// by how much that of an outline is at most, m.
template <typename Visit>
void ForEachPartNear(const Model<double>& model, int a, const Pose<double>& pose_a,
                     const Aabb& box_a, int b, const Pose<double>& pose_b, const Aabb& box_b,
                     double reach, const Visit& visit) {
  const ModelStructure& structure = *model.structure;
  const bool is_first = model.OutlineOf(a) != nullptr;
  const Outline* const outline = is_first ? model.OutlineOf(a) : model.OutlineOf(b);
  if (outline == nullptr) {
    structure.ForEachPartPair(a, b, visit);
    return;
  }
  const BodyIndex& lined = structure.bodies[is_first ? a : b];
  const BodyIndex& other = structure.bodies[is_first ? b : a];
  const auto visit_both = [&](int of_lined, int of_other) {
    visit(is_first ? PartPair{of_lined, of_other} : PartPair{of_other, of_lined});
  };
  if (other.shape == ShapeType::kHalfPlane) {
    for (const int run : outline->hull_runs()) visit_both(lined.PartOfRun(run), 0);
    for (int k = 1; k <= other.num_contact_points; ++k) {
      outline->ForEachRun(BoxInFrame(is_first ? pose_a : pose_b, is_first ? box_b : box_a, reach),
                          [&](int run) { visit_both(lined.PartOfRun(run), k); });
    }
    for (int k = 1; k <= lined.num_contact_points; ++k) visit_both(k, 0);
    return;
  }
  const Outline* const second = is_first ? model.OutlineOf(b) : nullptr;
  const Aabb box = BoxInFrame(is_first ? pose_a : pose_b, is_first ? box_b : box_a, reach);
  const auto visit_others = [&](const auto& visit_part) {
    if (second == nullptr) return visit_part(0);
    ForEachRunNear(*second, BoxInFrame(pose_b, box_a, reach),
                   [&](int run) { visit_part(other.PartOfRun(run)); });
  };
  ForEachRunNear(*outline, box, [&](int run) {
    visit_others([&](int part) { visit_both(lined.PartOfRun(run), part); });
    for (int k = 1; k <= other.num_contact_points; ++k) {
      visit_both(lined.PartOfRun(run), k);
    }
  });
  for (int k = 1; k <= lined.num_contact_points; ++k) {
    visit_others([&](int part) { visit_both(k, part); });
  }
}

/// Calls visit(PartPair) for all parts of two bodies, however far they are apart.
template <typename Visit>
void ForEachPart(const Model<double>& model, int a, int b, const Visit& visit) {
  const ModelStructure& structure = *model.structure;
  const auto runs = [&](int body) {
    const Outline* const outline = model.OutlineOf(body);
    return outline == nullptr ? 1 : outline->num_runs();
  };
  const BodyIndex& first = structure.bodies[a];
  const BodyIndex& second = structure.bodies[b];
  for (int i = 0; i < runs(a); ++i) {
    for (int j = 0; j < runs(b); ++j) visit(PartPair{first.PartOfRun(i), second.PartOfRun(j)});
    for (int k = 1; k <= second.num_contact_points; ++k) visit(PartPair{first.PartOfRun(i), k});
  }
  for (int k = 1; k <= first.num_contact_points; ++k) {
    for (int j = 0; j < runs(b); ++j) visit(PartPair{k, second.PartOfRun(j)});
  }
}

}  // namespace tangible
