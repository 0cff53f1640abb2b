// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The adjoint of a contact's rows: from the derivatives of a scalar with respect to each entry of
// the rows and the gap to those with respect to poses and shape parameters.

#include "tangible/dynamics/elements/contact.h"
#include "tangible/geometry/contact_geometry_adjoint.h"

namespace tangible {

/// Derivatives of a scalar with respect to a contact's rows and gap.
struct RowsAdjoint {
  double normal_a[3], normal_b[3], tangent_a[3], tangent_b[3];
  double gap;
};

/// Adds to `a_bar` and `b_bar` the derivatives that follow from `bar` through RowsFromGeometry and
/// EvaluateContact, whose result is `rows`.
void ContactRowsAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                        const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                        const Pose<double>& pose_b, const ContactRows<double>& rows,
                        const RowsAdjoint& bar, ContactSideAdjoint* a_bar,
                        ContactSideAdjoint* b_bar);

}  // namespace tangible
