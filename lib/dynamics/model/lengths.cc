// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/lengths.h"

#include "tangible/geometry/mass_properties.h"

namespace tangible {

Lengths::Lengths(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  double smallest = std::numeric_limits<double>::infinity();
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const BodyIndex& index = structure.bodies[body];
    const bool bounded = index.shape != ShapeType::kNone && index.shape != ShapeType::kHalfPlane;
    const double radius = bounded ? BoundingRadius(model.Shape(body)) : 0.0;
    radius_.push_back(radius);
    smallest = bounded ? std::min(smallest, radius) : smallest;
    const bool rod = index.shape == ShapeType::kNone && index.block >= 0;
    size_.push_back(
        rod ? std::sqrt(3.0 * model.parameters[index.inertia] / model.parameters[index.mass])
            : radius);
  }
  smallest_radius_ = std::isfinite(smallest) ? smallest : 1.0;
}

}  // namespace tangible
