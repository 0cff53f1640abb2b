// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The choice of features, by kind of pair. Internal to the module; collide.h says what is chosen.

#include "tangible/geometry/collide.h"
#include "tangible/geometry/convex_core.h"

namespace tangible::internal {

/// A feature with its gap, m.
struct Candidate {
  ContactFeature feature;
  double gap = 0.0;
};

/// Writes the candidates with gap below max_gap, smallest gap first; returns how many. At most two
/// are given.
int WriteCandidates(const Candidate* candidates, int count, double max_gap,
                    ContactFeature features[2]);

/// Contacts of two cores. The least penetrated face decides (separating axis test); where no face
/// of either separates best, the two nearest vertices do. O(vertices of a × vertices of b).
int CollideCores(const ConvexCore& a, const ConvexCore& b, double max_gap,
                 ContactFeature features[2]);

/// Which of the pair is the half-plane.
enum class PlaneSide { kFirst, kSecond };

/// Contacts of a core with the half-plane n·r ≤ offset (n unit, in the core's coordinates): the
/// lowest vertex and the other end of the face that looks down.
int CollideHalfPlane(const ConvexCore& core, const Vector2<double>& normal, double offset,
                     PlaneSide side, double max_gap, ContactFeature features[2]);

/// Contacts of a pair of which one is an ellipse: one at most, for an ellipse is strictly convex.
int CollideEllipse(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                   const ShapeView<double>& shape_b, const Pose<double>& pose_b, double max_gap,
                   ContactFeature features[2]);

}  // namespace tangible::internal
