// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Dual numbers over any scalar: a + b ε, ε² = 0, with b the rate of a along a motion.
//
// The rate of a constraint row, d/dt row(q(t)), is needed with derivatives of its own: Dual<double>
// gives the rate, Dual<Jet<N>> the rate in Jets. A Jet of a Jet does the same, but its operators
// take no double on either side.

#include <cmath>
#include <limits>

#include "tangible/math/scalar.h"

namespace tangible {

template <typename T>
struct Dual {
  T a;  ///< value
  T b;  ///< rate

  Dual() : a(0.0), b(0.0) {}
  Dual(double value) : a(value), b(0.0) {}  // NOLINT(google-explicit-constructor): a number
  Dual(const T& value, const T& rate) : a(value), b(rate) {}

  Dual& operator+=(const Dual& y) {
    a += y.a;
    b += y.b;
    return *this;
  }
  Dual& operator-=(const Dual& y) {
    a -= y.a;
    b -= y.b;
    return *this;
  }
  Dual& operator*=(const Dual& y) { return *this = *this * y; }
  Dual& operator/=(const Dual& y) { return *this = *this / y; }

  friend Dual operator-(const Dual& x) { return Dual(-x.a, -x.b); }
  friend Dual operator+(const Dual& x, const Dual& y) { return Dual(x.a + y.a, x.b + y.b); }
  friend Dual operator-(const Dual& x, const Dual& y) { return Dual(x.a - y.a, x.b - y.b); }
  friend Dual operator*(const Dual& x, const Dual& y) {
    return Dual(x.a * y.a, x.a * y.b + x.b * y.a);
  }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const T ratio = x.a / y.a;
    return Dual(ratio, (x.b - ratio * y.b) / y.a);
  }
  friend Dual operator+(double x, const Dual& y) { return Dual(x + y.a, y.b); }
  friend Dual operator+(const Dual& x, double y) { return Dual(x.a + y, x.b); }
  friend Dual operator-(double x, const Dual& y) { return Dual(x - y.a, -y.b); }
  friend Dual operator-(const Dual& x, double y) { return Dual(x.a - y, x.b); }
  friend Dual operator*(double x, const Dual& y) { return Dual(x * y.a, x * y.b); }
  friend Dual operator*(const Dual& x, double y) { return y * x; }
  friend Dual operator/(const Dual& x, double y) { return Dual(x.a / y, x.b / y); }
  friend Dual operator/(double x, const Dual& y) { return Dual(x) / y; }

  /// Only where x.a > 0.
  friend Dual sqrt(const Dual& x) {
    using std::sqrt;
    const T root = sqrt(x.a);
    return Dual(root, x.b / (2.0 * root));
  }
  friend Dual sin(const Dual& x) {
    using std::cos;
    using std::sin;
    return Dual(sin(x.a), cos(x.a) * x.b);
  }
  friend Dual cos(const Dual& x) {
    using std::cos;
    using std::sin;
    return Dual(cos(x.a), -sin(x.a) * x.b);
  }
};

template <typename T>
double ValueOf(const Dual<T>& x) {
  return ValueOf(x.a);
}

}  // namespace tangible

namespace Eigen {

template <typename T>
struct NumTraits<tangible::Dual<T>> {
  using Real = tangible::Dual<T>;
  using NonInteger = tangible::Dual<T>;
  using Nested = tangible::Dual<T>;
  using Literal = tangible::Dual<T>;
  static Real dummy_precision() { return Real(1e-12); }
  static Real epsilon() { return Real(std::numeric_limits<double>::epsilon()); }
  static int digits10() { return NumTraits<double>::digits10(); }
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    ReadCost = 1,
    AddCost = 2,
    MulCost = 4,
    HasFloatingPoint = 1,
    RequireInitialization = 1
  };
};

}  // namespace Eigen
