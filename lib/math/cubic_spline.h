// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The cubic spline through given points, twice continuously differentiable, with not-a-knot ends.
//
// Knots t_0 < ... < t_n with values y_i; lengths h_i = t_{i+1} − t_i, slopes
// d_i = (y_{i+1} − y_i) / h_i, and the unknown second derivatives m_i at the knots.
//
//   on piece i, with s = t − t_i:
//     y(t) = y_i + (d_i − h_i (2 m_i + m_{i+1}) / 6) s + m_i s² / 2 + (m_{i+1} − m_i) s³ / (6 h_i)
//   the rate is continuous at t_i, 0 < i < n:
//     h_{i−1} m_{i−1} + 2 (h_{i−1} + h_i) m_i + h_i m_{i+1} = 6 (d_i − d_{i−1})
//   the third derivative is continuous at t_1 and at t_{n−1} (no knot is there):
//     (m_1 − m_0) / h_0 = (m_2 − m_1) / h_1, and alike at the other end.
//
// The ends eliminate m_0 and m_n; what remains is tridiagonal and diagonally dominant, so that it
// is solved without pivoting, in time linear in the knots. Cubics are reproduced; the error of a
// smooth function is O(h⁴), of its rate O(h³), of its second derivative O(h²). Three points give
// the parabola, two the line and one the constant. (de Boor, A Practical Guide to Splines, IV.)
//
// Before the first knot and after the last one the value is held there: rate and second derivative
// are 0, so that they jump at the ends.

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// A function of time at one instant.
template <typename T>
struct SplinePoint {
  T value, rate, acceleration;
};

/// T: of the knots as of the values, which may both carry derivatives.
template <typename T>
class CubicSpline {
 public:
  /// At least one knot, strictly increasing (the caller has checked both); as many values.
  CubicSpline(std::vector<T> knots, std::vector<T> values);

  /// The spline at a time. The piece is that of `inside`, a time in the interior of the piece that
  /// is meant, because rates jump at the ends and a time may lie on a knot: the piece's own
  /// function has the right one-sided value and derivative. Logarithmic in the knots.
  SplinePoint<T> At(const T& time, double inside) const;
  /// m, one a knot.
  const std::vector<T>& curvatures() const { return curvatures_; }

 private:
  void SolveCurvatures();
  T Length(std::size_t piece) const { return knots_[piece + 1] - knots_[piece]; }
  T Slope(std::size_t piece) const { return (values_[piece + 1] - values_[piece]) / Length(piece); }

  std::vector<T> knots_, values_;
  std::vector<T> curvatures_;  ///< m, one a knot
};

template <typename T>
CubicSpline<T>::CubicSpline(std::vector<T> knots, std::vector<T> values)
    : knots_(std::move(knots)), values_(std::move(values)), curvatures_(knots_.size(), T(0.0)) {
  const std::size_t size = knots_.size();
  if (size == 3) {
    std::fill(curvatures_.begin(), curvatures_.end(),
              T(2.0 * (Slope(1) - Slope(0)) / (Length(0) + Length(1))));
  } else if (size > 3) {
    SolveCurvatures();
  }
}

template <typename T>
void CubicSpline<T>::SolveCurvatures() {
  const std::size_t last = knots_.size() - 1;
  // Row i: below[i] m_{i−1} + diagonal[i] m_i + above[i] m_{i+1} = right[i], for 0 < i < last.
  std::vector<T> below(last, T(0.0)), diagonal(last, T(0.0)), above(last, T(0.0));
  std::vector<T>& right = curvatures_;
  for (std::size_t i = 1; i < last; ++i) {
    const T before = Length(i - 1), after = Length(i);
    below[i] = before;
    diagonal[i] = 2.0 * (before + after);
    above[i] = after;
    right[i] = 6.0 * (Slope(i) - Slope(i - 1));
  }
  // The first and the last row without m_0 and m_n, divided by (h_0 + h_1) / h_1 and alike.
  const T h0 = Length(0), h1 = Length(1);
  diagonal[1] = h0 + 2.0 * h1;
  above[1] = h1 - h0;
  right[1] *= h1 / (h0 + h1);
  const T hn = Length(last - 1), hm = Length(last - 2);
  diagonal[last - 1] = hn + 2.0 * hm;
  below[last - 1] = hm - hn;
  right[last - 1] *= hm / (hn + hm);
  for (std::size_t i = 2; i < last; ++i) {
    const T factor = below[i] / diagonal[i - 1];
    diagonal[i] -= factor * above[i - 1];
    right[i] -= factor * right[i - 1];
  }
  curvatures_[last - 1] = right[last - 1] / diagonal[last - 1];
  for (std::size_t i = last - 2; i > 0; --i) {
    curvatures_[i] = (right[i] - above[i] * curvatures_[i + 1]) / diagonal[i];
  }
  curvatures_[0] = curvatures_[1] - (h0 / h1) * (curvatures_[2] - curvatures_[1]);
  curvatures_[last] =
      curvatures_[last - 1] + (hn / hm) * (curvatures_[last - 1] - curvatures_[last - 2]);
}

template <typename T>
SplinePoint<T> CubicSpline<T>::At(const T& time, double inside) const {
  if (!(inside > ValueOf(knots_.front()))) return {values_.front(), T(0.0), T(0.0)};
  if (!(inside < ValueOf(knots_.back()))) return {values_.back(), T(0.0), T(0.0)};
  const auto next =
      std::upper_bound(knots_.begin(), knots_.end(), inside,
                       [](double value, const T& knot) { return value < ValueOf(knot); });
  const std::size_t i = static_cast<std::size_t>(next - knots_.begin()) - 1;
  const T length = Length(i), s = time - knots_[i];
  const T& m = curvatures_[i];
  const T jerk = (curvatures_[i + 1] - m) / length;
  const T start_rate = Slope(i) - length * (2.0 * m + curvatures_[i + 1]) / 6.0;
  return {T(values_[i] + s * (start_rate + s * (0.5 * m + s * jerk / 6.0))),
          T(start_rate + s * (m + 0.5 * s * jerk)), T(m + s * jerk)};
}

}  // namespace tangible
