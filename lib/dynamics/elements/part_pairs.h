// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The parts of two bodies that may touch: of a polyline the runs that are near the other body,
// which its tree finds.

#include <cmath>

#include "tangible/dynamics/model/model.h"
#include "tangible/geometry/broad_phase.h"

namespace tangible {

/// The box, in a body's frame, of a box of the world that is grown by `margin`.
inline Aabb BoxInFrame(const Pose<double>& frame, const Aabb& box, double margin) {
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

/// Calls visit(PartPair) for the parts of two bodies that may touch, as
/// ModelStructure::ForEachPartPair. The boxes are grown by how far each body may go; `reach` says
/// by how much that of a polyline is, m.
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
  outline->ForEachRun(BoxInFrame(is_first ? pose_a : pose_b, is_first ? box_b : box_a, reach),
                      [&](int run) {
                        for (int k = 0; k <= other.num_contact_points; ++k) {
                          visit_both(lined.PartOfRun(run), k);
                        }
                      });
  for (int k = 1; k <= lined.num_contact_points; ++k) {
    visit_both(k, 0);
  }
}

}  // namespace tangible
