// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The adjoint of EvaluateContact: from the derivatives of a scalar with respect to gap, normal and
// point to its derivatives with respect to poses and shape parameters. It costs a tenth of an
// evaluation in Jets.

#include "tangible/geometry/collide.h"

namespace tangible {

/// Derivatives of a scalar with respect to the pose and the shape parameters of one body of a
/// contact.
struct ContactSideAdjoint {
  double pose[3] = {0.0, 0.0, 0.0};          ///< x, y, angle
  double numbers[kMostFeatureNumbers] = {};  ///< of FeatureNumbers, in its order
};

/// Adds to `a_bar` and `b_bar` the derivatives that follow from `bar`, those with respect to
/// normal, point and gap; `geometry` is the result of EvaluateContact. Where points coincide the
/// normal has the derivative zero, as in EvaluateContact.
void EvaluateContactAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                            const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                            const Pose<double>& pose_b, const ContactGeometry<double>& bar,
                            ContactSideAdjoint* a_bar, ContactSideAdjoint* b_bar);

}  // namespace tangible
