// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/dual.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/math/planar.h"

namespace tangible {
namespace {

TEST(DualTest, FollowsTheRulesOfDifferentiation) {
  const double x = 0.7;
  const Dual<double> t(x, 1.0);
  const Dual<double> f = 2.0 * sin(t) / (1.0 + t * t) - sqrt(3.0 * t) + cos(t) / 4.0 - t;
  const double g = 1.0 + x * x;
  EXPECT_DOUBLE_EQ(f.a, 2.0 * std::sin(x) / g - std::sqrt(3.0 * x) + std::cos(x) / 4.0 - x);
  EXPECT_NEAR(f.b,
              2.0 * std::cos(x) / g - 4.0 * x * std::sin(x) / (g * g) - 0.5 * std::sqrt(3.0 / x) -
                  std::sin(x) / 4.0 - 1.0,
              1e-15);
  Dual<double> sum = t;
  sum += t;
  sum *= t;
  sum -= t;
  sum /= t;  // 2 t − 1
  EXPECT_DOUBLE_EQ(sum.a, 2.0 * x - 1.0);
  EXPECT_NEAR(sum.b, 2.0, 1e-15);
}

TEST(DualTest, OverJetsGivesSecondDerivatives) {
  // x = 0.7 with derivative 1 in the Jet, moving at rate 1: f(x) = sin x has rate cos x, whose
  // derivative is −sin x.
  using T = LocalJet;
  const Dual<T> f = sin(Dual<T>(T(0.7, 0), T(1.0)));
  EXPECT_NEAR(f.b.a, std::cos(0.7), 1e-15);
  EXPECT_NEAR(f.b.v[0], -std::sin(0.7), 1e-15);
}

TEST(DualTest, WorksInEigenVectorsAndRotations) {
  using D = Dual<double>;
  const Rotation<D> rotation(D(0.3, 2.0));  // turns at 2 rad/s
  const Vector2<D> r = rotation * Vector2<D>(D(1.0), D(0.0));
  EXPECT_NEAR(r.x().b, -2.0 * std::sin(0.3), 1e-15);
  EXPECT_NEAR(r.y().b, 2.0 * std::cos(0.3), 1e-15);
  const D square = (r - Vector2<D>(D(0.5), D(0.0))).squaredNorm();
  EXPECT_NEAR(square.b, 2.0 * (r.x().a - 0.5) * r.x().b + 2.0 * r.y().a * r.y().b, 1e-14);
}

}  // namespace
}  // namespace tangible
