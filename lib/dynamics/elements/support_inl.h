// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of support.h; included by support.cc, and by assembly_inl.h and so
// by those of another scalar.

#include <cmath>
#include <numbers>

#include "tangible/dynamics/elements/support.h"
#include "tangible/dynamics/model/tolerances.h"

namespace tangible {
namespace internal {

/// The complete elliptic integrals of a parameter m in [0, 1] that DiscFriction needs.
template <typename T>
struct EllipticIntegrals {
  T k, e, b, c, d;
};

// The arithmetic-geometric mean, with the sums of its c_n², divided by the powers of m that vanish
// as m does.
template <typename T>
EllipticIntegrals<T> EllipticOf(const T& m) {
  using std::sqrt;
  constexpr int kIterations = 9;
  T a(1.0);
  T g = sqrt(1.0 - m);
  T share_d(0.5), share_c(0.0), e(0.0);
  double power = 1.0;
  for (int n = 0; n < kIterations; ++n) {
    const T mean = 0.5 * (a + g);
    g = sqrt(a * g);
    a = mean;
    e = n == 0 ? T(1.0 / (16.0 * a * a)) : T(m * m * e * e / (16.0 * a * a));
    share_d += power * m * e;
    share_c += 2.0 * power * e;
    power *= 2.0;
  }
  EllipticIntegrals<T> x;
  x.k = 0.5 * std::numbers::pi / a;
  x.d = x.k * share_d;
  x.b = x.k - x.d;
  x.c = x.k * share_c;
  x.e = x.k - m * x.d;
  return x;
}

}  // namespace internal

template <typename T>
void DiscFriction(const T& radius, const T twist[3], T friction[3]) {
  using std::sqrt;
  const T rim = radius * twist[2];
  const T slide2 = twist[0] * twist[0] + twist[1] * twist[1];
  const T spin2 = rim * rim;
  const bool turns = ValueOf(spin2) >= ValueOf(slide2);
  const T& larger = turns ? spin2 : slide2;
  for (int i = 0; i < 3; ++i) friction[i] = T(0.0);
  if (!(ValueOf(larger) > 0.0)) return;
  T m = (turns ? slide2 : spin2) / larger;
  // K is infinite at m = 1, where the centre of rotation lies on the rim; the derivatives of force
  // and torque grow like its logarithm.
  if (ValueOf(m) > 1.0 - kRimCentre) m -= ValueOf(m) - (1.0 - kRimCentre);
  const internal::EllipticIntegrals<T> x = internal::EllipticOf(m);
  const T speed = sqrt(larger);
  const T slide = (4.0 / (3.0 * std::numbers::pi)) * (x.e + x.b) / speed;
  T psi;
  if (turns) {
    psi = (4.0 - 2.0 * m) * x.e - (1.0 - m) * x.k;
  } else if (ValueOf(m) < 0.5) {
    psi = x.c - x.d + 3.0 * x.b;
  } else {
    psi = (x.d * (1.0 - m) - x.b) / m + 3.0 * x.b;  // C as a difference, finite at m = 1
  }
  friction[0] = -slide * twist[0];
  friction[1] = -slide * twist[1];
  friction[2] = (-4.0 / (9.0 * std::numbers::pi)) * psi * radius * rim / speed;
}

}  // namespace tangible
