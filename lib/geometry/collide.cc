// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/collide.h"

#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/convex_core.h"

namespace tangible {
namespace {

/// The half-plane in coordinates relative to the other body's position.
int CollideWithHalfPlane(const ShapeView<double>& shape, const Pose<double>& pose,
                         const ShapeView<double>& plane, const Pose<double>& plane_pose,
                         internal::PlaneSide side, double max_gap, ContactFeature features[2]) {
  const Vector2<double> normal(plane.numbers[0], plane.numbers[1]);
  const double norm = std::sqrt(normal.squaredNorm());
  if (!(norm > 0.0)) {
    return 0;
  }
  const Vector2<double> world_normal = plane_pose.rotation * Vector2<double>(normal / norm);
  const double offset =
      plane.numbers[2] / norm + world_normal.dot(plane_pose.position - pose.position);
  return internal::CollideHalfPlane(internal::ConvexCore(shape, pose, pose.position), world_normal,
                                    offset, side, max_gap, features);
}

/// The features of two circles are known without a search.
int CollideCircles(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                   const ShapeView<double>& shape_b, const Pose<double>& pose_b, double max_gap,
                   ContactFeature features[2]) {
  const double gap = std::sqrt((pose_a.position - pose_b.position).squaredNorm()) -
                     shape_a.numbers[0] - shape_b.numbers[0];
  if (!(gap < max_gap)) {
    return 0;
  }
  features[0] = {FeatureKind::kVertexVertex, 0, 0};
  return 1;
}

}  // namespace

int FindContactFeatures(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                        const ShapeView<double>& shape_b, const Pose<double>& pose_b,
                        double max_gap, ContactFeature features[2]) {
  if (shape_a.type == ShapeType::kCircle && shape_b.type == ShapeType::kCircle) {
    return CollideCircles(shape_a, pose_a, shape_b, pose_b, max_gap, features);
  }
  if (shape_a.type == ShapeType::kSpline || shape_b.type == ShapeType::kSpline) {
    return 0;
  }
  if (shape_a.type == ShapeType::kEllipse || shape_b.type == ShapeType::kEllipse) {
    return internal::CollideEllipse(shape_a, pose_a, shape_b, pose_b, max_gap, features);
  }
  const bool has_core_a = NumVertices(shape_a.type, shape_a.num_numbers) > 0;
  const bool has_core_b = NumVertices(shape_b.type, shape_b.num_numbers) > 0;
  if (has_core_a && has_core_b) {
    return internal::CollideCores(internal::ConvexCore(shape_a, pose_a, pose_a.position),
                                  internal::ConvexCore(shape_b, pose_b, pose_a.position), max_gap,
                                  features);
  }
  if (has_core_a && shape_b.type == ShapeType::kHalfPlane) {
    return CollideWithHalfPlane(shape_a, pose_a, shape_b, pose_b, internal::PlaneSide::kSecond,
                                max_gap, features);
  }
  if (has_core_b && shape_a.type == ShapeType::kHalfPlane) {
    return CollideWithHalfPlane(shape_b, pose_b, shape_a, pose_a, internal::PlaneSide::kFirst,
                                max_gap, features);
  }
  return 0;
}

}  // namespace tangible
