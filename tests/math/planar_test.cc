// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/planar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

Vector2<double> RandomVector(std::mt19937* generator) {
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  const double x = uniform(*generator);
  return {x, uniform(*generator)};
}

double RandomAngle(std::mt19937* generator) {
  return std::uniform_real_distribution<double>(-7.0, 7.0)(*generator);
}

TEST(Cross, IsTheSineOfTheAngle) {
  EXPECT_EQ(Cross<double>({1.0, 0.0}, {0.0, 1.0}), 1.0);
  EXPECT_EQ(Cross<double>({0.0, 1.0}, {1.0, 0.0}), -1.0);
  EXPECT_EQ(Cross<double>({2.0, 3.0}, {5.0, 7.0}), -1.0);
  EXPECT_EQ(Cross<double>({2.0, 3.0}, {4.0, 6.0}), 0.0);
}

TEST(Perp, TurnsLeftByARightAngle) {
  EXPECT_EQ(Perp<double>({1.0, 0.0}), Vector2<double>(0.0, 1.0));
  EXPECT_EQ(Perp<double>({0.0, 1.0}), Vector2<double>(-1.0, 0.0));
  std::mt19937 generator(1);
  for (int i = 0; i < 20; ++i) {
    const Vector2<double> a = RandomVector(&generator);
    const Vector2<double> b = RandomVector(&generator);
    EXPECT_EQ(Perp(a).dot(b), Cross(a, b));  // the same two products, only their order differs
    EXPECT_EQ(Perp(a).dot(a), 0.0);
  }
}

TEST(Rotation, IsTheIdentityByDefault) {
  EXPECT_EQ(Rotation<double>() * Vector2<double>(3.0, -4.0), Vector2<double>(3.0, -4.0));
}

TEST(Rotation, CounterClockwise) {
  const Vector2<double> turned = Rotation<double>(M_PI / 6.0) * Vector2<double>(2.0, 0.0);
  EXPECT_NEAR(turned.x(), std::sqrt(3.0), 4.0 * kEpsilon);
  EXPECT_NEAR(turned.y(), 1.0, 4.0 * kEpsilon);
}

TEST(Rotation, InverseUndoesAndLengthsStay) {
  std::mt19937 generator(2);
  for (int i = 0; i < 50; ++i) {
    const Rotation<double> rotation(RandomAngle(&generator));
    const Vector2<double> v = RandomVector(&generator);
    // Two products and a sum a component, twice: a few roundings of |v|.
    EXPECT_LE((rotation.Inverse(rotation * v) - v).norm(), 8.0 * kEpsilon * v.norm());
    EXPECT_NEAR((rotation * v).norm(), v.norm(), 8.0 * kEpsilon * v.norm());
  }
}

TEST(Rotation, VelocityIsPerp) {
  // d(R r)/dangle = Perp(R r): the sign convention of every contact and joint row.
  std::mt19937 generator(3);
  for (int i = 0; i < 20; ++i) {
    const Vector2<double> r = RandomVector(&generator);
    const Rotation<Jet<1>> rotation(Jet<1>(RandomAngle(&generator), 0));
    const Vector2<Jet<1>> turned = rotation * Vector2<Jet<1>>(Jet<1>(r.x()), Jet<1>(r.y()));
    EXPECT_NEAR(turned.x().v[0], -turned.y().a, 8.0 * kEpsilon * r.norm());
    EXPECT_NEAR(turned.y().v[0], turned.x().a, 8.0 * kEpsilon * r.norm());
    EXPECT_GT(std::abs(turned.x().v[0]) + std::abs(turned.y().v[0]), 0.0);
  }
}

/// The numbers of a pose and a point, in order: x, y, angle, point x, point y.
using Numbers = Eigen::Matrix<double, 5, 1>;

template <typename T>
Vector2<T> ToWorld(const Eigen::Matrix<T, 5, 1>& n) {
  return Pose<T>(Vector2<T>(n[0], n[1]), n[2]) * Vector2<T>(n[3], n[4]);
}

template <typename T>
Vector2<T> ToBody(const Eigen::Matrix<T, 5, 1>& n) {
  return Pose<T>(Vector2<T>(n[0], n[1]), n[2]).Inverse(Vector2<T>(n[3], n[4]));
}

/// Jets of `jets` against central differences of `values`, at random numbers.
template <typename Values, typename Jets>
void ExpectDerivatives(const Values& values, const Jets& jets, unsigned seed) {
  std::mt19937 generator(seed);
  const double step = 1e-5;
  for (int trial = 0; trial < 20; ++trial) {
    Numbers at;
    at << RandomVector(&generator), RandomAngle(&generator), RandomVector(&generator);
    Eigen::Matrix<Jet<5>, 5, 1> jet;
    for (int i = 0; i < 5; ++i) {
      jet[i] = Jet<5>(at[i], i);
    }
    const Vector2<Jet<5>> result = jets(jet);
    for (int i = 0; i < 5; ++i) {
      const Numbers change = step * Numbers::Unit(i);
      const Vector2<double> difference = (values(at + change) - values(at - change)) / (2.0 * step);
      for (int k = 0; k < 2; ++k) {
        EXPECT_EQ(result[k].a, values(at)[k]);
        // Truncation step²/6 times a third derivative of at most |point| + |position| < 6; rounding
        // eps times values below 6 over step.
        EXPECT_NEAR(result[k].v[i], difference[k], step * step + 6.0 * kEpsilon / step);
      }
    }
    EXPECT_GT(std::abs(result[0].v[2]) + std::abs(result[1].v[2]), 1e-3);
  }
}

TEST(Pose, JetsAgreeWithDifferences) {
  ExpectDerivatives(ToWorld<double>, ToWorld<Jet<5>>, 4);
  ExpectDerivatives(ToBody<double>, ToBody<Jet<5>>, 5);
}

TEST(Pose, InverseUndoes) {
  std::mt19937 generator(6);
  for (int i = 0; i < 50; ++i) {
    const Vector2<double> position = RandomVector(&generator);
    const Pose<double> pose(position, RandomAngle(&generator));
    const Vector2<double> point = RandomVector(&generator);
    const double scale = position.norm() + point.norm();
    EXPECT_LE((pose.Inverse(pose * point) - point).norm(), 8.0 * kEpsilon * scale);
    EXPECT_LE((pose * pose.Inverse(point) - point).norm(), 8.0 * kEpsilon * scale);
  }
}

TEST(Pose, DefaultIsTheWorldFrame) {
  EXPECT_EQ(Pose<double>() * Vector2<double>(1.0, 2.0), Vector2<double>(1.0, 2.0));
  EXPECT_EQ(Pose<Jet<2>>().rotation.cosine.v.norm(), 0.0);
}

TEST(Pose, ABodyAtRestKeepsItsDerivatives) {
  // Zero values must not swallow derivatives: a body at the origin, unturned.
  const Pose<Jet<3>> pose(Vector2<Jet<3>>(Jet<3>(0.0, 0), Jet<3>(0.0, 1)), Jet<3>(0.0, 2));
  const Vector2<Jet<3>> point = pose * Vector2<Jet<3>>(Jet<3>(0.0), Jet<3>(2.0));
  EXPECT_EQ(point.x().v, Vector3<double>(1.0, 0.0, -2.0));
  EXPECT_EQ(point.y().v, Vector3<double>(0.0, 1.0, 0.0));
}

}  // namespace
}  // namespace tangible
