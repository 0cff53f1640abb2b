// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Gap, normal and point of a contact feature, for any scalar. See collide.h for the equations.
//
// An edge and a half-plane are both a line of the body frame {r : m·r = d}, m unit and outward, so
// that vertex-edge, edge-vertex, vertex-plane and plane-vertex share one evaluation:
//   x = Rᵀ (p − position)   the vertex in the line's body frame
//   gap = m·x − d − r_vertex − r_line

#include <cmath>

#include "tangible/geometry/collide.h"
#include "tangible/geometry/ellipse_inl.h"
#include "tangible/geometry/spline_inl.h"

namespace tangible::internal {

/// A line of the body frame: m·r = d, m outward; a core with this edge is grown by `radius`.
template <typename T>
struct BoundaryLine {
  Vector2<T> normal;
  T offset;
  T radius;
};

/// v / |v|, and (0, 1) without derivatives where |v| = 0; `*norm` is |v|, or 1 there.
template <typename T>
Vector2<T> NormalisedOrUp(const Vector2<T>& v, T* norm) {
  using std::sqrt;
  const T square = v.x() * v.x() + v.y() * v.y();
  if (!(ValueOf(square) > 0.0)) {
    *norm = T(1.0);
    return Vector2<T>(T(0.0), T(1.0));
  }
  *norm = sqrt(square);
  const T inverse = 1.0 / *norm;
  return Vector2<T>(v.x() * inverse, v.y() * inverse);
}

/// Edges of boxes and capsules have constant normals, so that they are exact for a side or a length
/// of zero too.
template <typename T>
BoundaryLine<T> EdgeLine(const ShapeView<T>& shape, int edge) {
  switch (shape.type) {
    case ShapeType::kBox: {
      constexpr double kNormals[4][2] = {{0.0, -1.0}, {1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}};
      const T& size = shape.numbers[edge % 2 == 0 ? 1 : 0];
      return {Vector2<T>(T(kNormals[edge][0]), T(kNormals[edge][1])), 0.5 * size, T(0.0)};
    }
    case ShapeType::kCapsule:
      return {Vector2<T>(T(0.0), T(edge == 0 ? -1.0 : 1.0)), T(0.0), shape.numbers[1]};
    default: {
      const Vector2<T> start = Vertex(shape, edge);
      const Vector2<T> end = Vertex(shape, edge + 1 == shape.num_numbers / 2 ? 0 : edge + 1);
      T length;
      const Vector2<T> normal =
          NormalisedOrUp(Vector2<T>(end.y() - start.y(), start.x() - end.x()), &length);
      return {normal, normal.x() * start.x() + normal.y() * start.y(), T(0.0)};
    }
  }
}

/// Normal and offset of a half-plane are both divided by the length of the normal.
template <typename T>
BoundaryLine<T> HalfPlaneLine(const ShapeView<T>& shape) {
  T norm;
  const Vector2<T> normal = NormalisedOrUp(Vector2<T>(shape.numbers[0], shape.numbers[1]), &norm);
  return {normal, shape.numbers[2] / norm, T(0.0)};
}

/// A vertex of `shape` against a line of the body at `line_pose`; the normal points to the vertex.
/// `is_at_vertex`: ContactFeature's.
template <typename T>
ContactGeometry<T> VertexAgainstLine(const ShapeView<T>& shape, const Pose<T>& pose, int vertex,
                                     const BoundaryLine<T>& line, const Pose<T>& line_pose,
                                     bool is_at_vertex) {
  // The position of the body is subtracted first, so that little is lost to rounding far from the
  // origin.
  const Vector2<T> arm = pose.rotation * Vertex(shape, vertex);
  const Vector2<T> relative(pose.position.x() - line_pose.position.x() + arm.x(),
                            pose.position.y() - line_pose.position.y() + arm.y());
  const Vector2<T> normal = line_pose.rotation * line.normal;
  const T radius = CoreRadius(shape);
  ContactGeometry<T> result;
  result.normal = normal;
  result.gap =
      normal.x() * relative.x() + normal.y() * relative.y() - line.offset - radius - line.radius;
  const T depth = is_at_vertex ? radius : T(radius + 0.5 * result.gap);
  result.point = Vector2<T>(pose.position.x() + arm.x() - normal.x() * depth,
                            pose.position.y() + arm.y() - normal.y() * depth);
  return result;
}

template <typename T>
ContactGeometry<T> VertexAgainstVertex(const ContactFeature& feature, const ShapeView<T>& shape_a,
                                       const Pose<T>& pose_a, const ShapeView<T>& shape_b,
                                       const Pose<T>& pose_b) {
  const Vector2<T> arm_a = pose_a.rotation * Vertex(shape_a, feature.a);
  const Vector2<T> arm_b = pose_b.rotation * Vertex(shape_b, feature.b);
  const Vector2<T> apart(pose_a.position.x() - pose_b.position.x() + arm_a.x() - arm_b.x(),
                         pose_a.position.y() - pose_b.position.y() + arm_a.y() - arm_b.y());
  const T radius_a = CoreRadius(shape_a);
  ContactGeometry<T> result;
  T distance;
  result.normal = NormalisedOrUp(apart, &distance);
  // n·(p_a − p_b) equals the distance and has the same derivative, and is differentiable where the
  // points coincide too.
  result.gap = result.normal.x() * apart.x() + result.normal.y() * apart.y() - radius_a -
               CoreRadius(shape_b);
  const T depth = radius_a + 0.5 * result.gap;
  result.point = Vector2<T>(pose_a.position.x() + arm_a.x() - result.normal.x() * depth,
                            pose_a.position.y() + arm_a.y() - result.normal.y() * depth);
  return result;
}

/// The same contact with the roles of the two bodies exchanged.
template <typename T>
ContactGeometry<T> Swapped(ContactGeometry<T> contact) {
  contact.normal = Vector2<T>(-contact.normal.x(), -contact.normal.y());
  return contact;
}

/// An ellipse against a line of the body at `line_pose`: its point that the line's normal supports.
template <typename T>
ContactGeometry<T> EllipseAgainstLine(const ShapeView<T>& shape, const Pose<T>& pose,
                                      const BoundaryLine<T>& line, const Pose<T>& line_pose) {
  const Vector2<T> normal = line_pose.rotation * line.normal;
  const Vector2<T> arm = SupportOf(shape, pose, 0, Vector2<T>(-normal.x(), -normal.y())).arm;
  const Vector2<T> relative(pose.position.x() - line_pose.position.x() + arm.x(),
                            pose.position.y() - line_pose.position.y() + arm.y());
  ContactGeometry<T> result;
  result.normal = normal;
  result.gap = normal.x() * relative.x() + normal.y() * relative.y() - line.offset - line.radius;
  result.point = Vector2<T>(pose.position.x() + arm.x() - 0.5 * normal.x() * result.gap,
                            pose.position.y() + arm.y() - 0.5 * normal.y() * result.gap);
  return result;
}

/// The evaluation of a pair with an ellipse. It is a function of its own, because the evaluation of
/// other pairs takes 16 ns, and 7 ns more where the compiler optimises both together.
template <typename T>
[[gnu::noinline]] ContactGeometry<T> EvaluateEllipse(const ContactFeature& feature,
                                                     const ShapeView<T>& shape_a,
                                                     const Pose<T>& pose_a,
                                                     const ShapeView<T>& shape_b,
                                                     const Pose<T>& pose_b) {
  switch (feature.kind) {
    case FeatureKind::kVertexEdge:
      return EllipseAgainstLine(shape_a, pose_a, EdgeLine(shape_b, feature.b), pose_b);
    case FeatureKind::kEdgeVertex:
      return Swapped(EllipseAgainstLine(shape_b, pose_b, EdgeLine(shape_a, feature.a), pose_a));
    case FeatureKind::kVertexPlane:
      return EllipseAgainstLine(shape_a, pose_a, HalfPlaneLine(shape_b), pose_b);
    case FeatureKind::kPlaneVertex:
      return Swapped(EllipseAgainstLine(shape_b, pose_b, HalfPlaneLine(shape_a), pose_a));
    case FeatureKind::kVertexVertex:
    default:
      return RoundAgainstRound(feature, shape_a, pose_a, shape_b, pose_b);
  }
}

/// The evaluation of a contact with a spline, a function of its own as that of ellipses.
template <typename T>
[[gnu::noinline]] ContactGeometry<T> EvaluateSpline(const ContactFeature& feature,
                                                    const ShapeView<T>& shape_a,
                                                    const Pose<T>& pose_a,
                                                    const ShapeView<T>& shape_b,
                                                    const Pose<T>& pose_b) {
  if (feature.kind == FeatureKind::kVertexEdge) {
    return VertexAgainstSpline(shape_a, pose_a, feature.a, shape_b, pose_b, feature.b);
  }
  return Swapped(VertexAgainstSpline(shape_b, pose_b, feature.b, shape_a, pose_a, feature.a));
}

}  // namespace tangible::internal

namespace tangible {

template <typename T>
ContactFeature FeatureAt(const ContactFeature& feature, const ShapeView<T>& shape_a,
                         const Pose<T>& pose_a, const ShapeView<T>& shape_b,
                         const Pose<T>& pose_b) {
  if (feature.places == 0) return feature;
  ContactFeature moved = feature;
  if (feature.kind == FeatureKind::kVertexEdge) {
    moved.b = internal::PlaceAt(shape_b, feature.b,
                                internal::FootOver(shape_a, pose_a, feature.a, pose_b));
  } else {
    moved.a = internal::PlaceAt(shape_a, feature.a,
                                internal::FootOver(shape_b, pose_b, feature.b, pose_a));
  }
  return moved;
}

template <typename T>
ContactGeometry<T> EvaluateContact(const ContactFeature& feature, const ShapeView<T>& shape_a,
                                   const Pose<T>& pose_a, const ShapeView<T>& shape_b,
                                   const Pose<T>& pose_b) {
  using namespace internal;
  if (feature.places > 0) return EvaluateSpline(feature, shape_a, pose_a, shape_b, pose_b);
  if (shape_a.type == ShapeType::kEllipse || shape_b.type == ShapeType::kEllipse) {
    return EvaluateEllipse(feature, shape_a, pose_a, shape_b, pose_b);
  }
  switch (feature.kind) {
    case FeatureKind::kVertexEdge:
      return VertexAgainstLine(shape_a, pose_a, feature.a, EdgeLine(shape_b, feature.b), pose_b,
                               feature.is_at_vertex);
    case FeatureKind::kEdgeVertex:
      return Swapped(VertexAgainstLine(shape_b, pose_b, feature.b, EdgeLine(shape_a, feature.a),
                                       pose_a, feature.is_at_vertex));
    case FeatureKind::kVertexPlane:
      return VertexAgainstLine(shape_a, pose_a, feature.a, HalfPlaneLine(shape_b), pose_b,
                               feature.is_at_vertex);
    case FeatureKind::kPlaneVertex:
      return Swapped(VertexAgainstLine(shape_b, pose_b, feature.b, HalfPlaneLine(shape_a), pose_a,
                                       feature.is_at_vertex));
    case FeatureKind::kVertexVertex:
    default:
      return VertexAgainstVertex(feature, shape_a, pose_a, shape_b, pose_b);
  }
}

}  // namespace tangible
