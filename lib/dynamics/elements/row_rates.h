// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Constraint rows with their rates along a motion, for accelerations.
//
// A row of joints or contacts, r(q), is the gradient of a position C(q) or gives a sliding speed;
// along a motion q̇ = v its speed r v changes as follows:
//   d/dt (r v) = r a + ṙ v,    ṙ = (∂r/∂q) v,
// so that accelerations obey r a = −ṙ v where the speed is held. The rates ṙ v come from the same
// templates as the rows, evaluated in dual numbers whose rates are the twists (dual.h).

#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/math/dual.h"

namespace tangible {

/// A pose and its rate.
template <typename T>
struct MovingPose {
  Pose<T> pose;
  T twist[3] = {T(0.0), T(0.0), T(0.0)};
};

/// ṙ v of a joint's rows and of its coordinate: m/s² and rad/s².
template <typename T>
struct JointRates {
  T row[3] = {T(0.0), T(0.0), T(0.0)};
  T coordinate{0.0};
};

/// A joint's rows and rates; `numbers` as JointIndex describes its geometry.
template <typename T>
void EvaluateJointRates(JointType type, const MovingPose<T>& a, const MovingPose<T>& b,
                        const T* numbers, int num_numbers, JointRows<T>* rows,
                        JointRates<T>* rates);

/// ṙ v of a contact's normal and tangent rows, m/s².
template <typename T>
struct ContactRates {
  T normal{0.0};
  T tangent{0.0};
};

/// The rates of a limit of a joint, or of friction in it.
template <typename T>
void SetLimitRates(const ActiveContact& contact, const JointRates<T>& of_joint,
                   ContactRates<T>* rates) {
  (contact.IsJointFriction() ? rates->tangent : rates->normal) =
      contact.IsJointFriction() ? of_joint.coordinate : T(contact.side * of_joint.coordinate);
}

/// Memory for shapes in dual numbers.
template <typename T>
struct ContactRateScratch {
  std::vector<Dual<T>> numbers_a, numbers_b;
};

/// The rows and rates of a contact; of each shape only the parameters that the feature reads are
/// used.
template <typename T>
void EvaluateContactRates(const ContactFeature& feature, const ShapeView<T>& shape_a,
                          const MovingPose<T>& a, const ShapeView<T>& shape_b,
                          const MovingPose<T>& b, ContactRateScratch<T>* scratch,
                          ContactRows<T>* rows, ContactRates<T>* rates);

}  // namespace tangible
