// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Servos: bounded springs and dampers about a coordinate x that follow a target r(t),
//
//   u = −k (x − r) − d (ẋ − ṙ),   the effort is u within [−L, L]
//
// along the coordinate of a joint, the point of a force along x or y, or the angle of its body. The
// mode of a servo is 0 where the effort is u, and the sign of the bound at which it is held:
//
//   accelerations  the mode is that of the motion (State::servo_modes), and changes at events where
//                  |u| = L; there the effort is the same in both modes
//   a fixed step   the mode is that of u at the step's start. As of joints, the spring is that of
//                  the start's poses, with the target at the start, and the damping is implicit,
//                  with the mean rate of the target over the step

#include <string>
#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// The coordinate of a servo and the rows of its rate.
template <typename T>
struct ServoRows {
  int a = -1, b = -1;  ///< bodies
  RowPart<T> row_a, row_b;
  T coordinate;  ///< m or rad
};

/// "servo of joint hinge", "servo on body cart"; the contact names its event.
std::string NameOfServo(const ModelStructure& structure, const ActiveContact& contact);

/// Whether a servo's coordinate is a length, and not an angle.
bool Slides(const ModelStructure& structure, const ServoIndex& servo);

/// The rows of a servo of a force at the pose of its body; `at` is the force's point.
template <typename T>
void EvaluateForceServo(const ServoIndex& servo, int body, int world, const Pose<T>& pose,
                        const T at[2], ServoRows<T>* out) {
  out->a = body;
  out->b = world;
  for (int i = 0; i < 3; ++i) out->row_a[i] = out->row_b[i] = T(0.0);
  if (servo.axis == ServoIndex::kAngle) {
    out->row_a[2] = T(1.0);
    out->coordinate = pose.angle;
    return;
  }
  const Vector2<T> arm = pose.rotation * Vector2<T>(at[0], at[1]);
  const int i = servo.axis == ServoIndex::kX ? 0 : 1;
  out->row_a[i] = T(1.0);
  out->row_a[2] = i == 0 ? T(-arm.y()) : arm.x();
  out->coordinate = pose.position[i] + arm[i];
}

/// The time of a servo's target: that of accelerations, or a step [time, time + h].
template <typename T>
struct ServoTime {
  T time{0.0};
  double middle = 0.0;  ///< of accelerations: tells the piece of the target's signal
  double h = 0.0;       ///< 0: accelerations
};

template <typename T>
struct ServoTarget {
  T value{0.0};
  double rate = 0.0;
};

/// The target at a time; `number` is its parameter, which a signal replaces.
template <typename T>
ServoTarget<T> TargetOf(const ModelStructure& structure, const ServoIndex& servo, const T& number,
                        const ServoTime<T>& at);

/// u of servo k at a state; `terms`, if given: the sum of the magnitudes of its terms.
template <typename T>
T UnboundedEffort(const Model<T>& model, const State<T>& state, int k, const ServoTime<T>& at,
                  double* terms = nullptr);

/// The mode of servo k: the state's, or that of u.
template <typename T>
int ServoMode(const Model<T>& model, const State<T>& state, int k, const ServoTime<T>& at);

/// Whether servo k acts at a time within a motion: those of forces have windows.
bool IsServoOn(const Model<double>& model, int k, double middle);

/// Adds the effort of servo k at a state, in the state's mode, times a factor to the loads of the
/// moving bodies.
void AddServoLoad(const Model<double>& model, const State<double>& state, int k,
                  const ServoTime<double>& at, double factor, std::vector<double>* load);

}  // namespace tangible
