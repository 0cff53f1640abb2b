// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The choice of features, one function for each kind of pair. Internal to the module; collide.h
// says what is chosen.

#include "tangible/geometry/collide.h"
#include "tangible/geometry/convex_core.h"

namespace tangible::internal {

/// A feature with its gap, m.
struct Candidate {
  ContactFeature feature;
  double gap = 0.0;
};

/// Writes the candidates with a gap below max_gap, smallest gap first, and returns their number.
/// `candidates` has at most two.
int WriteCandidates(const Candidate* candidates, int count, double max_gap,
                    ContactFeature features[2]);

/// Contacts of two cores. The face with the largest separation decides (separating axis test);
/// where no face of either core separates them best, the two nearest vertices decide. O(vertices of
/// a × vertices of b).
int CollideCores(const ConvexCore& a, const ConvexCore& b, double max_gap,
                 ContactFeature features[2]);

/// Says which shape of the pair is the half-plane.
enum class PlaneSide { kFirst, kSecond };

/// Contacts of a core with the half-plane n·r ≤ offset (n unit, in the core's coordinates): the
/// lowest vertex and the other end of the face that faces the half-plane.
int CollideHalfPlane(const ConvexCore& core, const Vector2<double>& normal, double offset,
                     PlaneSide side, double max_gap, ContactFeature features[2]);

/// Contacts of a pair of which one is an ellipse: at most one, because an ellipse is strictly
/// convex.
int CollideEllipse(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                   const ShapeView<double>& shape_b, const Pose<double>& pose_b, double max_gap,
                   ContactFeature features[2]);

}  // namespace tangible::internal
