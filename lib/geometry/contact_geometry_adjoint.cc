// SPDX-License-Identifier: Apache-2.0
//
// This file reverses contact_geometry_inl.h line by line and keeps its names: x̄ is `x_bar`.
// Ellipses are evaluated in Jets.
#include "tangible/geometry/contact_geometry_adjoint.h"

#include <vector>

#include "tangible/geometry/contact_geometry_inl.h"

namespace tangible {
namespace {

using Vector = Vector2<double>;

double Dot(const Vector& x, const Vector& y) { return x.x() * y.x() + x.y() * y.y(); }

// The adjoint of n = v / norm with `norm` = |v|; where v = 0, norm = 1 and n are constants.
Vector NormalisedAdjoint(const Vector& v, const Vector& n, double norm, const Vector& n_bar) {
  if (!(Dot(v, v) > 0.0)) {
    return Vector(0.0, 0.0);
  }
  const double along = Dot(n, n_bar);
  return Vector((n_bar.x() - along * n.x()) / norm, (n_bar.y() - along * n.y()) / norm);
}

void AddPosition(const Vector& bar, double sign, ContactSideAdjoint* side) {
  side->pose[0] += sign * bar.x();
  side->pose[1] += sign * bar.y();
}

// The adjoint of y = R(θ) x with y known: adds to that of the angle and returns x̄ = Rᵀ ȳ.
Vector RotationAdjoint(const Pose<double>& pose, const Vector& y, const Vector& y_bar,
                       ContactSideAdjoint* side) {
  side->pose[2] += y_bar.y() * y.x() - y_bar.x() * y.y();
  const double c = pose.rotation.cosine;
  const double s = pose.rotation.sine;
  return Vector(c * y_bar.x() + s * y_bar.y(), c * y_bar.y() - s * y_bar.x());
}

// The adjoint of Vertex and CoreRadius, in the order of FeatureNumbers.
void VertexAdjoint(const ShapeView<double>& shape, int vertex, const Vector& bar, double radius_bar,
                   ContactSideAdjoint* side) {
  switch (shape.type) {
    case ShapeType::kCircle:
      side->numbers[0] += radius_bar;
      break;
    case ShapeType::kCapsule:
      side->numbers[0] += (vertex == 0 ? -0.5 : 0.5) * bar.x();
      side->numbers[1] += radius_bar;
      break;
    case ShapeType::kBox:
      side->numbers[0] += (vertex == 1 || vertex == 2 ? 0.5 : -0.5) * bar.x();
      side->numbers[1] += (vertex >= 2 ? 0.5 : -0.5) * bar.y();
      break;
    case ShapeType::kPolygon:
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      side->numbers[0] += bar.x();
      side->numbers[1] += bar.y();
      break;
    default:
      break;
  }
}

using FlatLine = internal::BoundaryLine<double>;

// `bar` is the line's adjoint.
void EdgeLineAdjoint(const ShapeView<double>& shape, int edge, const FlatLine& bar,
                     ContactSideAdjoint* side) {
  if (shape.type == ShapeType::kBox) {
    side->numbers[0] += 0.5 * bar.offset;
    return;
  }
  if (shape.type == ShapeType::kCapsule) {
    side->numbers[0] += bar.radius;
    return;
  }
  const Vector start = Vertex(shape, edge);
  const Vector end = Vertex(shape, edge + 1 == shape.num_numbers / 2 ? 0 : edge + 1);
  const Vector across(end.y() - start.y(), start.x() - end.x());
  double length;
  const Vector normal = internal::NormalisedOrUp(across, &length);
  const Vector normal_bar(bar.normal.x() + bar.offset * start.x(),
                          bar.normal.y() + bar.offset * start.y());
  const Vector across_bar = NormalisedAdjoint(across, normal, length, normal_bar);
  side->numbers[0] += bar.offset * normal.x() + across_bar.y();
  side->numbers[1] += bar.offset * normal.y() - across_bar.x();
  side->numbers[2] -= across_bar.y();
  side->numbers[3] += across_bar.x();
}

void HalfPlaneLineAdjoint(const ShapeView<double>& shape, const FlatLine& bar,
                          ContactSideAdjoint* side) {
  const Vector across(shape.numbers[0], shape.numbers[1]);
  double norm;
  const Vector normal = internal::NormalisedOrUp(across, &norm);
  Vector across_bar = NormalisedAdjoint(across, normal, norm, bar.normal);
  if (Dot(across, across) > 0.0) {
    const double norm_bar = -bar.offset * shape.numbers[2] / (norm * norm);
    across_bar =
        Vector(across_bar.x() + norm_bar * normal.x(), across_bar.y() + norm_bar * normal.y());
  }
  side->numbers[0] += across_bar.x();
  side->numbers[1] += across_bar.y();
  side->numbers[2] += bar.offset / norm;
}

// This returns the adjoint of the line.
FlatLine VertexAgainstLineAdjoint(const ShapeView<double>& shape, const Pose<double>& pose,
                                  int vertex, const FlatLine& line, const Pose<double>& line_pose,
                                  bool is_at_vertex, const ContactGeometry<double>& bar,
                                  ContactSideAdjoint* side, ContactSideAdjoint* line_side) {
  const Vector arm = pose.rotation * Vertex(shape, vertex);
  const Vector relative(pose.position.x() - line_pose.position.x() + arm.x(),
                        pose.position.y() - line_pose.position.y() + arm.y());
  const Vector normal = line_pose.rotation * line.normal;
  const double radius = CoreRadius(shape);
  const double gap = Dot(normal, relative) - line.offset - radius - line.radius;
  const double of_gap = is_at_vertex ? 0.0 : 0.5;
  const double depth = radius + of_gap * gap;
  const double depth_bar = -Dot(normal, bar.point);
  const double gap_bar = bar.gap + of_gap * depth_bar;
  const Vector normal_bar(bar.normal.x() - depth * bar.point.x() + gap_bar * relative.x(),
                          bar.normal.y() - depth * bar.point.y() + gap_bar * relative.y());
  const Vector relative_bar(gap_bar * normal.x(), gap_bar * normal.y());
  const Vector arm_bar(bar.point.x() + relative_bar.x(), bar.point.y() + relative_bar.y());
  AddPosition(arm_bar, 1.0, side);
  AddPosition(relative_bar, -1.0, line_side);
  const Vector vertex_bar = RotationAdjoint(pose, arm, arm_bar, side);
  VertexAdjoint(shape, vertex, vertex_bar, depth_bar - gap_bar, side);
  return {RotationAdjoint(line_pose, normal, normal_bar, line_side), -gap_bar, -gap_bar};
}

void VertexAgainstVertexAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                                const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                                const Pose<double>& pose_b, const ContactGeometry<double>& bar,
                                ContactSideAdjoint* a_bar, ContactSideAdjoint* b_bar) {
  const Vector arm_a = pose_a.rotation * Vertex(shape_a, feature.a);
  const Vector arm_b = pose_b.rotation * Vertex(shape_b, feature.b);
  const Vector apart(pose_a.position.x() - pose_b.position.x() + arm_a.x() - arm_b.x(),
                     pose_a.position.y() - pose_b.position.y() + arm_a.y() - arm_b.y());
  double distance;
  const Vector normal = internal::NormalisedOrUp(apart, &distance);
  const double radius_a = CoreRadius(shape_a);
  const double depth = radius_a + 0.5 * (Dot(normal, apart) - radius_a - CoreRadius(shape_b));
  const double depth_bar = -Dot(normal, bar.point);
  const double gap_bar = bar.gap + 0.5 * depth_bar;
  const Vector normal_bar(bar.normal.x() - depth * bar.point.x(),
                          bar.normal.y() - depth * bar.point.y());
  const Vector turned = NormalisedAdjoint(apart, normal, distance, normal_bar);
  const Vector apart_bar(gap_bar * normal.x() + turned.x(), gap_bar * normal.y() + turned.y());
  const Vector arm_a_bar(bar.point.x() + apart_bar.x(), bar.point.y() + apart_bar.y());
  const Vector arm_b_bar(-apart_bar.x(), -apart_bar.y());
  AddPosition(arm_a_bar, 1.0, a_bar);
  AddPosition(arm_b_bar, 1.0, b_bar);
  VertexAdjoint(shape_a, feature.a, RotationAdjoint(pose_a, arm_a, arm_a_bar, a_bar),
                depth_bar - gap_bar, a_bar);
  VertexAdjoint(shape_b, feature.b, RotationAdjoint(pose_b, arm_b, arm_b_bar, b_bar), -gap_bar,
                b_bar);
}

// The shape parameters that the feature reads, or the pose, as variables from `*next` on.
ShapeView<LocalJet> LocalShape(const ShapeView<double>& shape, bool is_edge, int feature,
                               std::vector<LocalJet>* numbers, int* next) {
  numbers->resize(shape.num_numbers);
  int used[kMostFeatureNumbers];
  const int count = FeatureNumbers(shape.type, shape.num_numbers, is_edge, feature, used);
  for (int i = 0; i < count; ++i) {
    (*numbers)[used[i]] = LocalJet(shape.numbers[used[i]], (*next)++);
  }
  return {shape.type, numbers->data(), shape.num_numbers};
}

Pose<LocalJet> LocalPose(const Pose<double>& pose, int* next) {
  Pose<LocalJet> local;
  local.position.x() = LocalJet(pose.position.x(), (*next)++);
  local.position.y() = LocalJet(pose.position.y(), (*next)++);
  local.angle = LocalJet(pose.angle, *next);
  local.rotation.cosine = LocalJet(pose.rotation.cosine);
  local.rotation.cosine.v[*next] = -pose.rotation.sine;
  local.rotation.sine = LocalJet(pose.rotation.sine);
  local.rotation.sine.v[*next] = pose.rotation.cosine;
  ++*next;
  return local;
}

// The adjoint for an ellipse or a spline, by Jets: their nearest points are roots of an equation,
// which the template differentiates.
void AdjointByJets(const ContactFeature& feature, const ShapeView<double>& shape_a,
                   const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                   const Pose<double>& pose_b, const ContactGeometry<double>& bar,
                   ContactSideAdjoint* a_bar, ContactSideAdjoint* b_bar) {
  std::vector<LocalJet> numbers_a;
  std::vector<LocalJet> numbers_b;
  int count = 0;
  const Pose<LocalJet> local_a = LocalPose(pose_a, &count);
  const Pose<LocalJet> local_b = LocalPose(pose_b, &count);
  const int first_a = count;
  const ShapeView<LocalJet> view_a =
      LocalShape(shape_a, feature.kind == FeatureKind::kEdgeVertex, feature.a, &numbers_a, &count);
  const int first_b = count;
  const ShapeView<LocalJet> view_b =
      LocalShape(shape_b, feature.kind == FeatureKind::kVertexEdge, feature.b, &numbers_b, &count);
  const ContactGeometry<LocalJet> geometry =
      EvaluateContact(feature, view_a, local_a, view_b, local_b);
  for (int i = 0; i < count; ++i) {
    double sum = bar.gap * geometry.gap.v[i];
    for (int k = 0; k < 2; ++k) {
      sum += bar.normal[k] * geometry.normal[k].v[i] + bar.point[k] * geometry.point[k].v[i];
    }
    double& entry = i < 3         ? a_bar->pose[i]
                    : i < first_a ? b_bar->pose[i - 3]
                    : i < first_b ? a_bar->numbers[i - first_a]
                                  : b_bar->numbers[i - first_b];
    entry += sum;
  }
}

// The same of a spline as of the spline that is one of its pieces alone: the numbers that the
// feature reads, in their order.
void AdjointOnPiece(ContactFeature feature, ShapeView<double> shape_a, const Pose<double>& pose_a,
                    ShapeView<double> shape_b, const Pose<double>& pose_b,
                    const ContactGeometry<double>& bar, ContactSideAdjoint* a_bar,
                    ContactSideAdjoint* b_bar) {
  const bool is_first = feature.kind == FeatureKind::kEdgeVertex;
  ShapeView<double>& spline = is_first ? shape_a : shape_b;
  int& place = is_first ? feature.a : feature.b;
  int used[kMostFeatureNumbers];
  double numbers[kMostFeatureNumbers];
  const int count = FeatureNumbers(spline.type, spline.num_numbers, true, place, used);
  for (int i = 0; i < count; ++i) numbers[i] = spline.numbers[used[i]];
  spline.numbers = numbers;
  spline.num_numbers = count;
  place %= internal::kPlacesOfPiece;
  AdjointByJets(feature, shape_a, pose_a, shape_b, pose_b, bar, a_bar, b_bar);
}

}  // namespace

void EvaluateContactAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                            const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                            const Pose<double>& pose_b, const ContactGeometry<double>& bar,
                            ContactSideAdjoint* a_bar, ContactSideAdjoint* b_bar) {
  if (feature.places > 0) {
    AdjointOnPiece(feature, shape_a, pose_a, shape_b, pose_b, bar, a_bar, b_bar);
    return;
  }
  if (shape_a.type == ShapeType::kEllipse || shape_b.type == ShapeType::kEllipse) {
    AdjointByJets(feature, shape_a, pose_a, shape_b, pose_b, bar, a_bar, b_bar);
    return;
  }
  switch (feature.kind) {
    case FeatureKind::kVertexEdge: {
      const FlatLine line = internal::EdgeLine(shape_b, feature.b);
      EdgeLineAdjoint(shape_b, feature.b,
                      VertexAgainstLineAdjoint(shape_a, pose_a, feature.a, line, pose_b,
                                               feature.is_at_vertex, bar, a_bar, b_bar),
                      b_bar);
      break;
    }
    case FeatureKind::kEdgeVertex: {
      const FlatLine line = internal::EdgeLine(shape_a, feature.a);
      EdgeLineAdjoint(
          shape_a, feature.a,
          VertexAgainstLineAdjoint(shape_b, pose_b, feature.b, line, pose_a, feature.is_at_vertex,
                                   internal::Swapped(bar), b_bar, a_bar),
          a_bar);
      break;
    }
    case FeatureKind::kVertexPlane: {
      const FlatLine line = internal::HalfPlaneLine(shape_b);
      HalfPlaneLineAdjoint(shape_b,
                           VertexAgainstLineAdjoint(shape_a, pose_a, feature.a, line, pose_b,
                                                    feature.is_at_vertex, bar, a_bar, b_bar),
                           b_bar);
      break;
    }
    case FeatureKind::kPlaneVertex: {
      const FlatLine line = internal::HalfPlaneLine(shape_a);
      HalfPlaneLineAdjoint(
          shape_a,
          VertexAgainstLineAdjoint(shape_b, pose_b, feature.b, line, pose_a, feature.is_at_vertex,
                                   internal::Swapped(bar), b_bar, a_bar),
          a_bar);
      break;
    }
    case FeatureKind::kVertexVertex:
      VertexAgainstVertexAdjoint(feature, shape_a, pose_a, shape_b, pose_b, bar, a_bar, b_bar);
      break;
  }
}

}  // namespace tangible
