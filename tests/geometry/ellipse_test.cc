// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/ellipse.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "random_shapes.h"
#include "tangible/geometry/tolerances.h"

namespace tangible::testing {
namespace {

using internal::IsUnbent;
using internal::RoundShape;
using internal::SeparatingDirection;

RoundShape Round(double a, double b, double angle) {
  RoundShape shape;
  shape.axes[0] = a;
  shape.axes[1] = b;
  shape.rotation = Rotation<double>(angle);
  return shape;
}

/// n·d − h_a − h_b, an ellipse's support function in closed form.
double Separation(const RoundShape& a, const RoundShape& b, const Vector2<double>& apart,
                  const Vector2<double>& n) {
  const auto height = [&](const RoundShape& shape) {
    const Vector2<double> m = shape.rotation.Inverse(n);
    return std::hypot(shape.axes[0] * m.x(), shape.axes[1] * m.y());
  };
  return n.dot(apart) - height(a) - height(b);
}

/// No direction of a fine fan separates more, however slender the ellipses are and however deep one
/// is in the other.
TEST(SeparatingDirectionTest, NoDirectionSeparatesMore) {
  std::mt19937 random(20240705);
  for (int sample = 0; sample < 400; ++sample) {
    const double slender = std::pow(10.0, -Uniform(&random, 0.0, sample % 2 == 0 ? 1.0 : 6.0));
    const RoundShape a = Round(1.0, slender, Uniform(&random, -3.0, 3.0));
    const RoundShape b = sample % 3 == 0
                             ? RoundShape()
                             : Round(Uniform(&random, 0.1, 1.0), Uniform(&random, 0.1, 1.0),
                                     Uniform(&random, -3.0, 3.0));
    const Vector2<double> apart(Uniform(&random, -1.5, 1.5), Uniform(&random, -1.5, 1.5));
    const Vector2<double> found = SeparatingDirection(a, b, apart);
    EXPECT_NEAR(found.norm(), 1.0, 1e-15);
    const double largest = Separation(a, b, apart, found);
    for (int k = 0; k < 2000; ++k) {
      const double angle = std::numbers::pi / 1000.0 * k;
      const Vector2<double> n(std::cos(angle), std::sin(angle));
      // What counts as equal (kLengthRounding) of sizes of up to 7 m.
      ASSERT_LE(Separation(a, b, apart, n), largest + 7.0 * kLengthRounding)
          << sample << " " << angle;
    }
  }
}

TEST(SeparatingDirectionTest, OfAPointIsTheNormalThroughIt) {
  // From the point of the ellipse at the anomaly E, 0.3 m out along its normal.
  const RoundShape ellipse = Round(0.8, 0.3, 0.5);
  for (int k = 0; k < 40; ++k) {
    const double anomaly = 0.157 * k;
    Vector2<double> normal(0.3 * std::cos(anomaly), 0.8 * std::sin(anomaly));
    normal = ellipse.rotation * Vector2<double>(normal / normal.norm());
    const Vector2<double> point =
        ellipse.rotation * Vector2<double>(0.8 * std::cos(anomaly), 0.3 * std::sin(anomaly)) +
        0.3 * normal;
    EXPECT_LE((SeparatingDirection(RoundShape(), ellipse, point) - normal).norm(), 1e-14);
    EXPECT_LE((SeparatingDirection(ellipse, RoundShape(), -point) + normal).norm(), 1e-14);
  }
}

TEST(SeparatingDirectionTest, IsUpWhereAllAreAlike) {
  const RoundShape circle = Round(0.4, 0.4, 0.1);
  EXPECT_EQ(SeparatingDirection(circle, RoundShape(), Vector2<double>(0.0, 0.0)),
            Vector2<double>(0.0, 1.0));
  EXPECT_TRUE(IsUnbent(0.0, 1.0));
  EXPECT_TRUE(IsUnbent(std::numeric_limits<double>::quiet_NaN(), 1.0));
  EXPECT_FALSE(IsUnbent(1e-12, 1.0));
}

}  // namespace
}  // namespace tangible::testing
