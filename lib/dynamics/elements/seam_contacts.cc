// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/seam_contacts.h"

#include "tangible/geometry/tolerances.h"

namespace tangible {

bool AreOfOneSeam(const Model<double>& model, const ActiveContact& x,
                  const ContactGeometry<double>& of_x, const ActiveContact& y,
                  const ContactGeometry<double>& of_y) {
  if (!x.IsOfShapes() || !y.IsOfShapes() || (x.a == y.a && x.b == y.b)) {
    return false;
  }
  const bool first_of_x = model.HasSeams(x.a, x.feature.part_a);
  const bool first_of_y = model.HasSeams(y.a, y.feature.part_a);
  const bool has_seams = (first_of_x || model.HasSeams(x.b, x.feature.part_b)) &&
                         (first_of_y || model.HasSeams(y.b, y.feature.part_b));
  const double sign = first_of_x == first_of_y ? 1.0 : -1.0;
  return has_seams && (first_of_x ? x.b : x.a) == (first_of_y ? y.b : y.a) &&
         (of_x.point - of_y.point).norm() <= 2.0 * kFlushStep &&
         (of_x.normal - sign * of_y.normal).norm() <= kFlushTurn;
}

}  // namespace tangible
