// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/force_inl.h"
#include "tangible/dynamics/model/tolerances.h"

namespace tangible {
namespace internal {

double SignalValue(const Signal& signal, const std::vector<double>& column, double time) {
  const auto& times = signal.time;
  const auto next = std::upper_bound(times.begin(), times.end(), time);
  if (next == times.begin()) {
    return column.front();
  }
  const size_t k = next - times.begin() - 1;
  if (next == times.end() || signal.interpolation == Signal::Interpolation::kConstant) {
    return column[k];
  }
  const double fraction = (time - times[k]) / (times[k + 1] - times[k]);
  return column[k] + fraction * (column[k + 1] - column[k]);
}

double SignalRate(const Signal& signal, const std::vector<double>& column, double time) {
  const auto& times = signal.time;
  const auto next = std::upper_bound(times.begin(), times.end(), time);
  if (next == times.begin() || next == times.end() ||
      signal.interpolation == Signal::Interpolation::kConstant) {
    return 0.0;
  }
  const size_t k = next - times.begin() - 1;
  return (column[k + 1] - column[k]) / (times[k + 1] - times[k]);
}

double Inside(double x, double low, double high) {
  const double near = kSameTime * (high - low);
  return x < low - near || x > high + near ? 0.0 : x < low + near || x > high - near ? 0.5 : 1.0;
}

}  // namespace internal

double IntegrateSignal(const Signal& signal, const std::vector<double>& column, double from,
                       double to) {
  if (column.empty() || !(from < to)) {
    return 0.0;
  }
  double integral = 0.0;
  double left = from;
  while (left < to) {
    const auto next = std::upper_bound(signal.time.begin(), signal.time.end(), left);
    const double right = next == signal.time.end() ? to : std::min(to, *next);
    // The midpoint rule is exact for both kinds, which are linear or constant within a piece.
    integral += (right - left) * internal::SignalValue(signal, column, 0.5 * (left + right));
    left = right;
  }
  return integral;
}

double MeanEffort(const ModelStructure& structure, const JointIndex& joint, double t, double h) {
  const Signal& signal = structure.signals[joint.effort_signal];
  return IntegrateSignal(signal, signal.value, t, t + h) / h;
}

template <typename T>
void ForceAt(const ModelStructure& structure, const ForceIndex& force, const T& angle,
             const T* numbers, const T* start, const T* end, const T& t, double middle, T out[3]) {
  if ((start != nullptr && ValueOf(*start) > middle) ||
      (end != nullptr && middle > ValueOf(*end))) {
    out[0] = out[1] = out[2] = T(0.0);
    return;
  }
  if (force.force_signal >= 0) {
    const Signal& signal = structure.signals[force.force_signal];
    out[0] = SignalAt(signal, signal.x, t, middle);
    out[1] = SignalAt(signal, signal.y, t, middle);
  } else {
    out[0] = numbers[2];
    out[1] = numbers[3];
  }
  const Vector2<T> arm = Rotation<T>(angle) * Vector2<T>(numbers[0], numbers[1]);
  out[2] = Cross(arm, Vector2<T>(out[0], out[1]));
  if (force.torque_signal >= 0) {
    const Signal& signal = structure.signals[force.torque_signal];
    out[2] += SignalAt(signal, signal.value, t, middle);
  } else {
    out[2] += numbers[4];
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                                    \
  template T WindowOverlap<T>(double, double, const T*, const T*);                                 \
  template void ForceImpulse<T>(const ModelStructure&, const ForceIndex&, double, double,          \
                                const T&, const T*, const T*, const T*, T[3]);                     \
  template T SignalAt<T>(const Signal&, const std::vector<double>&, const T&, double);             \
  template void ForceAt<T>(const ModelStructure&, const ForceIndex&, const T&, const T*, const T*, \
                           const T*, const T&, double, T[3]);                                      \
  template T FrictionDecay<T>(const T[3], const T&);                                               \
  template void EvaluateSpring<T>(const Pose<T>&, const Pose<T>&, const T*, SpringRow<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
