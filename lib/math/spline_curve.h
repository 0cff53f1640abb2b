// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The cubic spline through points of the plane, parametrised by the length of the chords: twice
// continuously differentiable, with not-a-knot ends (cubic_spline.h), or periodic if it is closed.
//
// Of the periodic one, with chords h_i from point i to point i + 1 and slopes d_i of one coordinate
// (indices modulo n), the second derivatives m_i solve:
//   h_{i−1} m_{i−1} + 2 (h_{i−1} + h_i) m_i + h_i m_{i+1} = 6 (d_i − d_{i−1}),
// which is tridiagonal but for two corners. These are a matrix of rank one (Sherman and Morrison).
//
// Between point i and point i + 1 the curve is
//   c(s) = p_i + r s + m_i s²/2 + (m_{i+1} − m_i) s³/(6 h),    0 ≤ s ≤ h,
//   r = (p_{i+1} − p_i)/h − h (2 m_i + m_{i+1})/6.

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tangible/math/cubic_spline.h"
#include "tangible/math/planar.h"
#include "tangible/math/scalar.h"

namespace tangible {

/// The second derivatives of the periodic spline through `values` with the knots' distances
/// `lengths`, at least 3 of each.
template <typename T>
std::vector<T> PeriodicCurvatures(const std::vector<T>& lengths, const std::vector<T>& values) {
  const std::size_t n = values.size();
  const auto slope = [&](std::size_t i) {
    return T((values[(i + 1) % n] - values[i]) / lengths[i]);
  };
  const T& corner = lengths[n - 1];
  std::vector<T> diagonal(n, T(0.0)), right(n, T(0.0)), column(n, T(0.0));
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n;
    diagonal[i] = 2.0 * (lengths[before] + lengths[i]);
    right[i] = 6.0 * (slope(i) - slope(before));
  }
  // The matrix is a tridiagonal one plus (g, 0, …, 0, corner)ᵀ (1, 0, …, 0, corner / g).
  const T g = -diagonal[0];
  column[0] = g;
  column[n - 1] = corner;
  diagonal[0] -= g;
  diagonal[n - 1] -= corner * corner / g;
  for (std::size_t i = 1; i < n; ++i) {
    const T factor = lengths[i - 1] / diagonal[i - 1];
    diagonal[i] -= factor * lengths[i - 1];
    right[i] -= factor * right[i - 1];
    column[i] -= factor * column[i - 1];
  }
  for (std::size_t i = n; i-- > 0;) {
    if (i + 1 < n) {
      right[i] -= lengths[i] * right[i + 1];
      column[i] -= lengths[i] * column[i + 1];
    }
    right[i] /= diagonal[i];
    column[i] /= diagonal[i];
  }
  const T share =
      (right[0] + corner / g * right[n - 1]) / (1.0 + column[0] + corner / g * column[n - 1]);
  for (std::size_t i = 0; i < n; ++i) right[i] -= share * column[i];
  return right;
}

/// The second derivatives with respect to the length along the chords, m_x and m_y of each point in
/// turn. `points`: x0, y0, x1, y1, …, no two equal ones in a row; of a closed curve the first point
/// is repeated at the end.
template <typename T>
std::vector<T> SplineCurvatures(const std::vector<T>& points) {
  using std::sqrt;
  const std::size_t size = points.size() / 2;
  const bool closed = size > 3 && ValueOf(points[0]) == ValueOf(points[2 * size - 2]) &&
                      ValueOf(points[1]) == ValueOf(points[2 * size - 1]);
  std::vector<T> lengths, knots = {T(0.0)};
  for (std::size_t i = 0; i + 1 < size; ++i) {
    const T x = points[2 * i + 2] - points[2 * i];
    const T y = points[2 * i + 3] - points[2 * i + 1];
    lengths.push_back(T(sqrt(x * x + y * y)));
    knots.push_back(T(knots.back() + lengths.back()));
  }
  std::vector<T> result(2 * size, T(0.0));
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<T> values;
    for (std::size_t i = 0; i + (closed ? 1 : 0) < size; ++i) values.push_back(points[2 * i + k]);
    std::vector<T> of =
        closed ? PeriodicCurvatures(lengths, values) : CubicSpline<T>(knots, values).curvatures();
    if (closed) of.push_back(of.front());
    for (std::size_t i = 0; i < size; ++i) result[2 * i + k] = of[i];
  }
  return result;
}

/// A curve at one place, with its derivatives with respect to the length along the chord.
template <typename T>
struct SplineAt {
  Vector2<T> place, rate, bend;
};

/// The cubic between two points; s is counted from the first one, m.
template <typename T>
struct SplinePiece {
  Vector2<T> start, rate, bend, jerk;
  T length;

  SplineAt<T> At(const T& s) const {
    SplineAt<T> at;
    for (int i = 0; i < 2; ++i) {
      at.place[i] = start[i] + s * (rate[i] + s * (0.5 * bend[i] + s * jerk[i] / 6.0));
      at.rate[i] = rate[i] + s * (bend[i] + 0.5 * s * jerk[i]);
      at.bend[i] = bend[i] + s * jerk[i];
    }
    return at;
  }
};

/// A piece from its two points and the second derivatives there, eight numbers.
template <typename T>
SplinePiece<T> MakePiece(const T& x0, const T& y0, const T& x1, const T& y1, const T* m) {
  using std::sqrt;
  SplinePiece<T> piece;
  const Vector2<T> along(x1 - x0, y1 - y0);
  const T h = sqrt(along.x() * along.x() + along.y() * along.y());
  piece.start = Vector2<T>(x0, y0);
  piece.length = h;
  for (int i = 0; i < 2; ++i) {
    piece.rate[i] = along[i] / h - h * (2.0 * m[i] + m[2 + i]) / 6.0;
    piece.bend[i] = m[i];
    piece.jerk[i] = (m[2 + i] - m[i]) / h;
  }
  return piece;
}

/// The control points of a piece as a Bézier curve, whose hull contains it.
inline std::array<Vector2<double>, 4> ControlPointsOf(const SplinePiece<double>& piece) {
  const SplineAt<double> start = piece.At(0.0), end = piece.At(piece.length);
  const double third = piece.length / 3.0;
  return {start.place, start.place + third * start.rate, end.place - third * end.rate, end.place};
}

/// How far the legs of a piece's control polygon turn, rad: at least as far as its tangent.
inline double TurnOf(const SplinePiece<double>& piece) {
  const std::array<Vector2<double>, 4> points = ControlPointsOf(piece);
  double turn = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector2<double> in = points[i + 1] - points[i], out = points[i + 2] - points[i + 1];
    turn += std::abs(std::atan2(Cross(in, out), in.dot(out)));
  }
  return turn;
}

}  // namespace tangible
