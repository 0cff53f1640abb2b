// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contact_rows_adjoint.h"

namespace tangible {
namespace {

// The adjoint of PointRow(direction, arm) = (direction, arm × direction), times `sign`.
void PointRowAdjoint(const Vector2<double>& direction, const Vector2<double>& arm,
                     const double bar[3], double sign, Vector2<double>* direction_bar,
                     Vector2<double>* arm_bar) {
  direction_bar->x() += sign * (bar[0] - arm.y() * bar[2]);
  direction_bar->y() += sign * (bar[1] + arm.x() * bar[2]);
  arm_bar->x() += sign * direction.y() * bar[2];
  arm_bar->y() -= sign * direction.x() * bar[2];
}

}  // namespace

void ContactRowsAdjoint(const ContactFeature& feature, const ShapeView<double>& shape_a,
                        const Pose<double>& pose_a, const ShapeView<double>& shape_b,
                        const Pose<double>& pose_b, const ContactRows<double>& rows,
                        const RowsAdjoint& bar, ContactSideAdjoint* a_bar,
                        ContactSideAdjoint* b_bar) {
  const Vector2<double>& normal = rows.geometry.normal;
  const Vector2<double> tangent(normal.y(), -normal.x());
  const Vector2<double> arm_a = rows.geometry.point - pose_a.position;
  const Vector2<double> arm_b = rows.geometry.point - pose_b.position;
  Vector2<double> normal_bar(0.0, 0.0);
  Vector2<double> tangent_bar(0.0, 0.0);
  Vector2<double> arm_a_bar(0.0, 0.0);
  Vector2<double> arm_b_bar(0.0, 0.0);
  // The angular entry of a disc's normal row is 0.
  const double turn_a = shape_a.type == ShapeType::kCircle ? 0.0 : bar.normal_a[2];
  const double turn_b = shape_b.type == ShapeType::kCircle ? 0.0 : bar.normal_b[2];
  const double normal_a_bar[3] = {bar.normal_a[0], bar.normal_a[1], turn_a};
  const double normal_b_bar[3] = {bar.normal_b[0], bar.normal_b[1], turn_b};
  PointRowAdjoint(normal, arm_a, normal_a_bar, 1.0, &normal_bar, &arm_a_bar);
  PointRowAdjoint(normal, arm_b, normal_b_bar, -1.0, &normal_bar, &arm_b_bar);
  PointRowAdjoint(tangent, arm_a, bar.tangent_a, 1.0, &tangent_bar, &arm_a_bar);
  PointRowAdjoint(tangent, arm_b, bar.tangent_b, -1.0, &tangent_bar, &arm_b_bar);
  ContactGeometry<double> geometry_bar;
  geometry_bar.normal =
      Vector2<double>(normal_bar.x() - tangent_bar.y(), normal_bar.y() + tangent_bar.x());
  geometry_bar.point = arm_a_bar + arm_b_bar;
  geometry_bar.gap = bar.gap;
  for (int k = 0; k < 2; ++k) {
    a_bar->pose[k] -= arm_a_bar[k];
    b_bar->pose[k] -= arm_b_bar[k];
  }
  EvaluateContactAdjoint(feature, shape_a, pose_a, shape_b, pose_b, geometry_bar, a_bar, b_bar);
}

}  // namespace tangible
