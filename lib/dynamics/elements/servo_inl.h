// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of servo.h; included by servo.cc, load_speed.cc, assembly_inl.h, and
// so by those of another scalar.

#include <cmath>

#include "tangible/dynamics/elements/force_inl.h"
#include "tangible/dynamics/elements/servo.h"

namespace tangible {

template <typename T>
ServoTarget<T> TargetOf(const ModelStructure& structure, const ServoIndex& servo, const T& number,
                        const ServoTime<T>& at) {
  if (servo.signal < 0) return {number, 0.0};
  const Signal& signal = structure.signals[servo.signal];
  const bool moves = signal.interpolation == Signal::Interpolation::kLinear;
  if (at.h > 0.0) {
    const double start = ValueOf(at.time);
    const double value = internal::SignalValue(signal, signal.value, start);
    const double end = internal::SignalValue(signal, signal.value, start + at.h);
    return {T(value), moves ? (end - value) / at.h : 0.0};
  }
  return {SignalAt(signal, signal.value, at.time, at.middle),
          internal::SignalRate(signal, signal.value, at.middle)};
}

template <typename T>
void EvaluateServo(const Model<T>& model, const State<T>& state, const ServoIndex& servo,
                   ServoRows<T>* out) {
  const ModelStructure& s = *model.structure;
  if (servo.joint < 0) {
    const ForceIndex& force = s.forces[servo.force];
    EvaluateForceServo(servo, force.body, s.world(), state.PoseOf(force.body),
                       &model.parameters[force.numbers], out);
    return;
  }
  const JointIndex& joint = s.joints[servo.joint];
  JointRows<T> rows;
  EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                &model.parameters[joint.geometry], &rows);
  *out = {joint.a, joint.b, rows.coordinate_a, rows.coordinate_b, rows.coordinate};
}

template <typename T>
T UnboundedEffort(const Model<T>& model, const State<T>& state, int k, const ServoTime<T>& at,
                  double* terms) {
  const ServoIndex& servo = model.structure->servos[k];
  const T* x = &model.parameters[servo.numbers];
  ServoRows<T> rows;
  EvaluateServo(model, state, servo, &rows);
  const ServoTarget<T> target = TargetOf(*model.structure, servo, x[ServoIndex::kTarget], at);
  T rate(-target.rate);
  for (int i = 0; i < 3; ++i) {
    rate +=
        rows.row_a[i] * state.twist[3 * rows.a + i] + rows.row_b[i] * state.twist[3 * rows.b + i];
  }
  if (terms != nullptr) {
    *terms =
        ValueOf(x[ServoIndex::kStiffness]) *
            (std::abs(ValueOf(rows.coordinate)) + std::abs(ValueOf(target.value))) +
        ValueOf(x[ServoIndex::kDamping]) * (std::abs(ValueOf(rate)) + 2.0 * std::abs(target.rate));
  }
  return -x[ServoIndex::kStiffness] * (rows.coordinate - target.value) -
         x[ServoIndex::kDamping] * rate;
}

template <typename T>
int ServoMode(const Model<T>& model, const State<T>& state, int k, const ServoTime<T>& at) {
  const ServoIndex& servo = model.structure->servos[k];
  if (!servo.has_limit) return 0;
  if (!state.servo_modes.empty()) return state.servo_modes[k];
  const double effort = ValueOf(UnboundedEffort(model, state, k, at));
  const double limit = ValueOf(model.parameters[servo.Number(ServoIndex::kLimit)]);
  return effort > limit ? 1 : effort < -limit ? -1 : 0;
}

}  // namespace tangible
