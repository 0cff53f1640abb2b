// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/row_rates.h"

namespace tangible {
namespace {

template <typename T>
Pose<Dual<T>> DualPose(const MovingPose<T>& moving) {
  const Rotation<T>& rotation = moving.pose.rotation;
  const T& omega = moving.twist[2];
  Pose<Dual<T>> dual;
  for (int i = 0; i < 2; ++i) {
    dual.position[i] = Dual<T>(moving.pose.position[i], moving.twist[i]);
  }
  dual.angle = Dual<T>(moving.pose.angle, omega);
  dual.rotation.cosine = Dual<T>(rotation.cosine, -rotation.sine * omega);
  dual.rotation.sine = Dual<T>(rotation.sine, rotation.cosine * omega);
  return dual;
}

// A row, and the term that its rate adds to the acceleration along it.
template <typename T>
T SplitRow(const RowPart<Dual<T>>& dual, const T twist[3], RowPart<T>* row) {
  T rate(0.0);
  for (int i = 0; i < 3; ++i) {
    (*row)[i] = dual[i].a;
    rate += dual[i].b * twist[i];
  }
  return rate;
}

template <typename T>
ShapeView<Dual<T>> DualShape(const ShapeView<T>& shape, bool is_edge, int feature,
                             std::vector<Dual<T>>* numbers) {
  if (static_cast<int>(numbers->size()) < shape.num_numbers) {
    numbers->resize(shape.num_numbers);
  }
  int used[kMostFeatureNumbers];
  const int count = FeatureNumbers(shape.type, shape.num_numbers, is_edge, feature, used);
  for (int i = 0; i < count; ++i) {
    (*numbers)[used[i]] = Dual<T>(shape.numbers[used[i]], T(0.0));
  }
  return {shape.type, numbers->data(), shape.num_numbers};
}

}  // namespace

// For a hinge the rates sum up to the centripetal term, Ȧ v = −ω_a² r_a + ω_b² r_b with the arms r.
template <typename T>
void EvaluateJointRates(JointType type, const MovingPose<T>& a, const MovingPose<T>& b,
                        const T* numbers, int num_numbers, JointRows<T>* rows,
                        JointRates<T>* rates) {
  constexpr int kMostNumbers = 7;
  Dual<T> dual_numbers[kMostNumbers];
  for (int i = 0; i < num_numbers; ++i) {
    dual_numbers[i] = Dual<T>(numbers[i], T(0.0));
  }
  JointRows<Dual<T>> dual;
  EvaluateJoint(type, DualPose(a), DualPose(b), dual_numbers, &dual);
  rows->rows = dual.rows;
  for (int k = 0; k < dual.rows; ++k) {
    rates->row[k] = SplitRow(dual.row_a[k], a.twist, &rows->row_a[k]) +
                    SplitRow(dual.row_b[k], b.twist, &rows->row_b[k]);
    rows->error[k] = dual.error[k].a;
  }
  if (HasCoordinate(type)) {
    rates->coordinate = SplitRow(dual.coordinate_a, a.twist, &rows->coordinate_a) +
                        SplitRow(dual.coordinate_b, b.twist, &rows->coordinate_b);
    rows->coordinate = dual.coordinate.a;
  }
}

template <typename T>
void EvaluateContactRates(const ContactFeature& feature, const ShapeView<T>& shape_a,
                          const MovingPose<T>& a, const ShapeView<T>& shape_b,
                          const MovingPose<T>& b, ContactRateScratch<T>* scratch,
                          ContactRows<T>* rows, ContactRates<T>* rates) {
  const ShapeView<Dual<T>> dual_a =
      DualShape(shape_a, feature.kind == FeatureKind::kEdgeVertex, feature.a, &scratch->numbers_a);
  const ShapeView<Dual<T>> dual_b =
      DualShape(shape_b, feature.kind == FeatureKind::kVertexEdge, feature.b, &scratch->numbers_b);
  const Pose<Dual<T>> pose_a = DualPose(a);
  const Pose<Dual<T>> pose_b = DualPose(b);
  ContactRows<Dual<T>> dual;
  dual.geometry = EvaluateContact(feature, dual_a, pose_a, dual_b, pose_b);
  RowsFromGeometry(shape_a.type, pose_a.position, shape_b.type, pose_b.position, &dual);
  rates->normal = SplitRow(dual.normal_a, a.twist, &rows->normal_a) +
                  SplitRow(dual.normal_b, b.twist, &rows->normal_b);
  rates->tangent = SplitRow(dual.tangent_a, a.twist, &rows->tangent_a) +
                   SplitRow(dual.tangent_b, b.twist, &rows->tangent_b);
  rows->geometry.gap = dual.geometry.gap.a;
  for (int i = 0; i < 2; ++i) {
    rows->geometry.normal[i] = dual.geometry.normal[i].a;
    rows->geometry.point[i] = dual.geometry.point[i].a;
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                              \
  template void EvaluateJointRates<T>(JointType, const MovingPose<T>&, const MovingPose<T>&, \
                                      const T*, int, JointRows<T>*, JointRates<T>*);         \
  template void EvaluateContactRates<T>(                                                     \
      const ContactFeature&, const ShapeView<T>&, const MovingPose<T>&, const ShapeView<T>&, \
      const MovingPose<T>&, ContactRateScratch<T>*, ContactRows<T>*, ContactRates<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
