// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Joints: position errors C(q) and their rows A(q) = ∂C/∂q on the twists of the two bodies.
//
//   kRevolute    C = p_a − p_b                                  (m, 2 rows)
//   kWeld        the same and θ_a − θ_b − θ0                    (3 rows)
//   kPrismatic   C = (n·(p_a − p_b), θ_a − θ_b − θ0), n = u⊥, u fixed in b   (2 rows)
//   kDistance    C = |p_a − p_b| − L                            (1 row)
//   kFixedAngle  C = θ_a − θ_b − θ0                             (1 row)
//
//   kCoupling    C = x_1 + r x_2 − c, of two joints' coordinates  (1 row)
//
//   kRope, kLimitedCoupling  none                               (0 rows)
//
// p: the anchors of each body; x_1 and x_2 are coordinates. The coordinate of a revolute joint is
// θ_a − θ_b − θ0, of a prismatic one u·(p_a − p_b), of a rope |p_a − p_b|, of a coupling with
// limits C; efforts, damping, friction, motors and limits act along its row. One file a type:
// joint_*_inl.h.

#include "tangible/dynamics/model/model_releases.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

template <typename T>
struct JointRows {
  int rows = 0;
  RowPart<T> row_a[3], row_b[3];
  T error[3];
  RowPart<T> coordinate_a, coordinate_b;  ///< where HasCoordinate
  T coordinate;                           ///< rad or m, 0 as drawn
  RowPart<T> row_c, row_d;                ///< of a coupling of more than two bodies
};

/// Whether a joint has a coordinate, along which limits act.
inline bool HasCoordinate(JointType type) {
  return type == JointType::kRevolute || type == JointType::kPrismatic ||
         type == JointType::kRope || type == JointType::kLimitedCoupling;
}

/// Whether its geometry begins with an anchor in each body's frame.
inline bool HasAnchors(JointType type) {
  return type != JointType::kFixedAngle && type != JointType::kCoupling &&
         type != JointType::kLimitedCoupling;
}

/// Evaluates a joint other than a coupling at two poses; `numbers` as JointIndex describes its
/// geometry. A distance joint whose anchors coincide has the row (1, 0), its derivative 0.
template <typename T>
void EvaluateJoint(JointType type, const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                   JointRows<T>* out);

/// Evaluates any joint of a model at a state; one that has been released has no rows.
template <typename T>
void EvaluateJoint(const Model<T>& model, const State<T>& state, const JointIndex& joint,
                   JointRows<T>* out);

/// The share that coordinate k of a coupling has in its rows: an element of its own, on the bodies
/// of the coupled joint.
template <typename T>
void EvaluateShare(const Model<T>& model, const State<T>& state, const JointIndex& coupling, int k,
                   JointRows<T>* out);

/// The row that maps the twist of a body to the velocity along `direction` of the point at `arm`
/// from its centre of mass (world frame).
template <typename T>
RowPart<T> PointRow(const Vector2<T>& direction, const Vector2<T>& arm) {
  return {direction.x(), direction.y(), Cross(arm, direction)};
}

template <typename T>
RowPart<T> Negative(const RowPart<T>& row) {
  return {-row[0], -row[1], -row[2]};
}

}  // namespace tangible
