// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "tangible/geometry/collide_core.h"
#include "tangible/geometry/mass_properties.h"
#include "tangible/geometry/tolerances.h"

namespace tangible::internal {
namespace {

/// The ellipse of a pair and the other shape. EvaluateContact computes the gaps of all candidates.
class EllipsePair {
 public:
  EllipsePair(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
              const ShapeView<double>& shape_b, const Pose<double>& pose_b)
      : shape_a_(shape_a),
        pose_a_(pose_a),
        shape_b_(shape_b),
        pose_b_(pose_b),
        ellipse_is_first_(shape_a.type == ShapeType::kEllipse),
        origin_(pose_a.position),
        other_(ellipse_is_first_ ? shape_b : shape_a, ellipse_is_first_ ? pose_b : pose_a,
               origin_) {}

  Candidate AgainstPlane() const {
    const ContactFeature feature = {
        ellipse_is_first_ ? FeatureKind::kVertexPlane : FeatureKind::kPlaneVertex, 0, 0};
    return {feature, Evaluate(feature).gap};
  }

  /// The nearest feature of the other core: the one with the largest gap among those that contain
  /// their nearest point. On a border, where an edge and its end have the same gap, it is the edge.
  /// Where the centre of the ellipse is deep inside there may be no such feature; then it is the
  /// edge with the largest gap.
  Candidate AgainstCore() const {
    Candidate best;
    Candidate any_edge;
    bool found = false;
    bool has_edge = false;
    for (int i = 0; i < other_.Size() && other_.Size() > 1; ++i) {
      const CoreEdge edge = other_.Edge(i);
      if (!(edge.length > 0.0)) {
        continue;
      }
      const ContactFeature feature = ellipse_is_first_
                                         ? ContactFeature{FeatureKind::kVertexEdge, 0, i}
                                         : ContactFeature{FeatureKind::kEdgeVertex, i, 0};
      const ContactGeometry<double> geometry = Evaluate(feature);
      const double along = edge.tangent.dot(Vector2<double>(geometry.point - origin_) - edge.start);
      const double room = kLengthRounding * edge.length;
      if (along >= -room && along <= edge.length + room && (!found || geometry.gap > best.gap)) {
        best = {feature, geometry.gap};
        found = true;
      }
      if (!has_edge || geometry.gap > any_edge.gap) {
        any_edge = {feature, geometry.gap};
        has_edge = true;
      }
    }
    // Where the shapes are apart, only one feature contains its nearest point.
    const bool is_apart = found && best.gap + other_.Radius() > 0.0;
    for (int i = 0; i < other_.Size() && !is_apart; ++i) {
      const ContactFeature feature = {FeatureKind::kVertexVertex, ellipse_is_first_ ? 0 : i,
                                      ellipse_is_first_ ? i : 0};
      const ContactGeometry<double> geometry = Evaluate(feature);
      const double room = found ? kLengthRounding * (std::abs(best.gap) + Size()) : 0.0;
      if (IsWithinCone(i, geometry.normal) && (!found || geometry.gap > best.gap + room)) {
        best = {feature, geometry.gap};
        found = true;
      }
    }
    return found ? best : any_edge;
  }

 private:
  ContactGeometry<double> Evaluate(const ContactFeature& feature) const {
    return EvaluateContact(feature, shape_a_, pose_a_, shape_b_, pose_b_);
  }

  double Size() const { return BoundingRadius(shape_a_) + BoundingRadius(shape_b_); }

  /// Whether a direction from the second body to the first lies between the normals of the two
  /// edges at a vertex of the other core.
  bool IsWithinCone(int vertex, const Vector2<double>& normal) const {
    if (other_.Size() < 2) {
      return true;
    }
    const double outward = ellipse_is_first_ ? 1.0 : -1.0;
    const double after = outward * normal.dot(other_.Edge(vertex).tangent);
    const double before = outward * normal.dot(other_.Edge(other_.Previous(vertex)).tangent);
    return after <= kLengthRounding && before >= -kLengthRounding;
  }

  const ShapeView<double>& shape_a_;
  const Pose<double>& pose_a_;
  const ShapeView<double>& shape_b_;
  const Pose<double>& pose_b_;
  const bool ellipse_is_first_;
  const Vector2<double> origin_;
  const ConvexCore other_;
};

}  // namespace

int CollideEllipse(const ShapeView<double>& shape_a, const Pose<double>& pose_a,
                   const ShapeView<double>& shape_b, const Pose<double>& pose_b, double max_gap,
                   ContactFeature features[2]) {
  for (const ShapeType type : {shape_a.type, shape_b.type}) {
    if (type == ShapeType::kNone) {
      return 0;
    }
  }
  const EllipsePair pair(shape_a, pose_a, shape_b, pose_b);
  Candidate nearest;
  if (shape_a.type == ShapeType::kHalfPlane || shape_b.type == ShapeType::kHalfPlane) {
    nearest = pair.AgainstPlane();
  } else {
    const double distance = std::sqrt((pose_a.position - pose_b.position).squaredNorm());
    if (distance - BoundingRadius(shape_a) - BoundingRadius(shape_b) >= max_gap) {
      return 0;
    }
    nearest = pair.AgainstCore();
  }
  return WriteCandidates(&nearest, 1, max_gap, features);
}

}  // namespace tangible::internal
