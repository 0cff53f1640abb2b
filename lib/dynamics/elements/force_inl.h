// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of force.h; included by force.cc, and by verification's file for
// another scalar.

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/force.h"

namespace tangible {
namespace internal {

/// A column of a signal at a time.
double SignalValue(const Signal& signal, const std::vector<double>& column, double time);

/// The rate of a column on the piece that contains a time; 0 where the signal is constant.
double SignalRate(const Signal& signal, const std::vector<double>& column, double time);

/// The derivative of an overlap with respect to an end of the window: 1 inside, 1/2 at an end of
/// the step, 0 outside. An end of a step is k dt rounded, so times that differ from it by less than
/// kSameTime of a step count as equal to it, in both steps that share it.
double Inside(double x, double low, double high);

}  // namespace internal

template <typename T>
T WindowOverlap(double t, double h, const T* start, const T* end) {
  const double from = start ? std::max(t, ValueOf(*start)) : t;
  const double to = end ? std::min(t + h, ValueOf(*end)) : t + h;
  T overlap(std::max(0.0, to - from));
  if (start && ValueOf(*start) < (end ? ValueOf(*end) : HUGE_VAL)) {
    overlap += -internal::Inside(ValueOf(*start), t, t + h) * (*start - ValueOf(*start));
  }
  if (end && ValueOf(*end) > (start ? ValueOf(*start) : -HUGE_VAL)) {
    overlap += internal::Inside(ValueOf(*end), t, t + h) * (*end - ValueOf(*end));
  }
  return overlap;
}

template <typename T>
T SignalAt(const Signal& signal, const std::vector<double>& column, const T& t, double middle) {
  if (column.empty()) {
    return T(0.0);
  }
  const auto next = std::upper_bound(signal.time.begin(), signal.time.end(), middle);
  if (next == signal.time.begin()) {
    return T(column.front());
  }
  const size_t k = next - signal.time.begin() - 1;
  if (next == signal.time.end() || signal.interpolation == Signal::Interpolation::kConstant) {
    return T(column[k]);
  }
  const double rate = (column[k + 1] - column[k]) / (signal.time[k + 1] - signal.time[k]);
  return column[k] + rate * (t - signal.time[k]);
}

template <typename T>
void ForceImpulse(const ModelStructure& structure, const ForceIndex& force, double t, double h,
                  const T& angle, const T* numbers, const T* start, const T* end, T impulse[3]) {
  const T overlap = WindowOverlap(t, h, start, end);
  const double from = start ? std::max(t, ValueOf(*start)) : t;
  const double to = end ? std::min(t + h, ValueOf(*end)) : t + h;
  // The integral of a signal over the overlap; its values at the ends give the derivatives with
  // respect to them.
  const auto integrate = [&](const Signal& signal, const std::vector<double>& column) {
    T integral(IntegrateSignal(signal, column, from, to));
    if (!column.empty() && start) {
      integral += -internal::Inside(ValueOf(*start), t, t + h) *
                  internal::SignalValue(signal, column, ValueOf(*start)) *
                  (*start - ValueOf(*start));
    }
    if (!column.empty() && end) {
      integral += internal::Inside(ValueOf(*end), t, t + h) *
                  internal::SignalValue(signal, column, ValueOf(*end)) * (*end - ValueOf(*end));
    }
    return integral;
  };
  if (force.force_signal >= 0) {
    const Signal& signal = structure.signals[force.force_signal];
    impulse[0] = integrate(signal, signal.x);
    impulse[1] = integrate(signal, signal.y);
  } else {
    impulse[0] = overlap * numbers[2];
    impulse[1] = overlap * numbers[3];
  }
  const Vector2<T> arm = Rotation<T>(angle) * Vector2<T>(numbers[0], numbers[1]);
  impulse[2] = Cross(arm, Vector2<T>(impulse[0], impulse[1]));
  if (force.torque_signal >= 0) {
    const Signal& signal = structure.signals[force.torque_signal];
    impulse[2] += integrate(signal, signal.value);
  } else {
    impulse[2] += overlap * numbers[4];
  }
}

template <typename T>
T FrictionDecay(const T numbers[3], const T& speed) {
  using std::exp;
  const T ratio = speed / numbers[2];
  T decay = numbers[0] - numbers[1];
  // exp(−700) = 1e-304, while the derivatives of a ratio that overflows are not finite.
  constexpr double kVanished = 700.0;
  if (ValueOf(ratio) * ValueOf(ratio) < kVanished) {
    decay *= T(1.0) - exp(-ratio * ratio);
  }
  return ValueOf(speed) < 0.0 ? T(-decay) : decay;
}

template <typename T>
void EvaluateSpring(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                    SpringRow<T>* out) {
  using std::sqrt;
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  const Vector2<T> offset = pose_a.position + arm_a - pose_b.position - arm_b;
  const T squared = offset.squaredNorm();
  // At coincident anchors the direction is undefined and sqrt has no derivative.
  const bool apart = ValueOf(squared) > 0.0;
  out->length = apart ? T(sqrt(squared)) : T(0.0);
  const Vector2<T> direction =
      apart ? Vector2<T>(offset / out->length) : Vector2<T>(T(0.0), T(0.0));
  out->row_a = PointRow(direction, arm_a);
  out->row_b = Negative(PointRow(direction, arm_b));
  const T& stiffness = numbers[SpringIndex::kStiffness];
  const T& rest_length = numbers[SpringIndex::kRestLength];
  out->tension = stiffness * (out->length - rest_length);
  const Vector2<T> pull = (offset - direction * rest_length) * stiffness;
  out->pull_a = PointRow(pull, arm_a);
  out->pull_b = Negative(PointRow(pull, arm_b));
}

}  // namespace tangible
