// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/lengths.h"

#include "tangible/geometry/mass_properties.h"

namespace tangible {

double RadiusOf(const Model<double>& model, int body) {
  const BodyIndex& index = model.structure->bodies[body];
  double radius = index.shape == ShapeType::kNone || index.shape == ShapeType::kHalfPlane
                      ? 0.0
                      : BoundingRadius(model.Shape(body));
  for (int part = 1; part <= index.num_contact_points; ++part) {
    radius = std::max(radius, BoundingRadius(model.Shape(body, part)));
  }
  return radius;
}

Aabb BoxOf(const Model<double>& model, int body, const Pose<double>& pose, double margin) {
  const Outline* const outline = model.OutlineOf(body);
  const Curve* const curve = model.CurveOf(body);
  Aabb box = outline != nullptr ? BoxOfOutline(*outline, pose, margin)
             : curve != nullptr ? BoxOfCurve(*curve, pose, margin)
                                : ComputeAabb(model.Shape(body), pose, margin);
  for (int part = 1; part <= model.structure->bodies[body].num_contact_points; ++part) {
    const Aabb point = ComputeAabb(model.Shape(body, part), pose, margin);
    box = {std::min(box.min_x, point.min_x), std::min(box.min_y, point.min_y),
           std::max(box.max_x, point.max_x), std::max(box.max_y, point.max_y)};
  }
  return box;
}

Lengths::Lengths(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  double smallest = std::numeric_limits<double>::infinity();
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const BodyIndex& index = structure.bodies[body];
    const double radius = RadiusOf(model, body);
    radius_.push_back(radius);
    smallest = radius > 0.0 ? std::min(smallest, radius) : smallest;
    const bool rod = index.shape == ShapeType::kNone && index.block >= 0 && !(radius > 0.0);
    size_.push_back(
        rod ? std::sqrt(3.0 * model.parameters[index.inertia] / model.parameters[index.mass])
            : radius);
  }
  smallest_radius_ = std::isfinite(smallest) ? smallest : 1.0;
}

}  // namespace tangible
