// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The adjoint of EvaluateContact: what a scalar's derivative with respect to gap, normal and point
// makes of that with respect to poses and shape numbers. A tenth of what it costs by Jets.

#include "tangible/geometry/collide.h"

namespace tangible {

/// Derivatives of a scalar with respect to one body's part in a contact.
struct ContactSideAdjoint {
  double pose[3] = {0.0, 0.0, 0.0};          ///< x, y, angle
  double numbers[4] = {0.0, 0.0, 0.0, 0.0};  ///< of FeatureNumbers, in its order
};

/// Adds to `a_bar` and `b_bar` what `bar` (of normal, point and gap) pulls back to; `geometry` is
/// EvaluateContact's. Where shapes coincide the normal has no derivative, as there.
void EvaluateContactAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                            const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                            const Pose<double>& pose_b, const ContactGeometry<double>& bar,
                            ContactSideAdjoint* a_bar, ContactSideAdjoint* b_bar);

}  // namespace tangible
