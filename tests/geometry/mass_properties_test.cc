// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "random_shapes.h"

namespace tangible::testing {
namespace {

constexpr double kPi = std::numbers::pi;

/// Rounding of a few operations, relative.
void ExpectClose(double value, double expected) {
  EXPECT_NEAR(value, expected, 1e-14 * std::abs(expected));
}

TEST(MassProperties, Circle) {
  const TestShape circle = Circle(0.5);
  ExpectClose(Area(circle.View()), 0.25 * kPi);
  ExpectClose(UniformInertia(circle.View(), 4.0), 0.5);
  EXPECT_EQ(Centroid(circle.View()).norm(), 0.0);
  EXPECT_EQ(BoundingRadius(circle.View()), 0.5);
}

TEST(MassProperties, Box) {
  const TestShape box = Box(3.0, 4.0);
  ExpectClose(Area(box.View()), 12.0);
  ExpectClose(UniformInertia(box.View(), 12.0), 25.0);
  ExpectClose(BoundingRadius(box.View()), 2.5);
}

TEST(MassProperties, Ellipse) {
  const TestShape ellipse = Ellipse(3.0, 0.5);
  ExpectClose(Area(ellipse.View()), 1.5 * kPi);
  ExpectClose(UniformInertia(ellipse.View(), 4.0), 9.25);
  EXPECT_EQ(BoundingRadius(ellipse.View()), 3.0);
  ExpectClose(UniformInertia(Ellipse(0.7, 0.7).View(), 2.0),
              UniformInertia(Circle(0.7).View(), 2.0));
}

TEST(MassProperties, Polygon) {
  // The triangle (0,0), (3,0), (0,3): area 4.5, centroid (1, 1), about the origin m (9 + 9)/6.
  const TestShape triangle = Polygon({0, 0, 3, 0, 0, 3});
  ExpectClose(Area(triangle.View()), 4.5);
  ExpectClose(Centroid(triangle.View()).x(), 1.0);
  ExpectClose(Centroid(triangle.View()).y(), 1.0);
  ExpectClose(UniformInertia(triangle.View(), 2.0), 6.0);
  ExpectClose(BoundingRadius(triangle.View()), 3.0);
  // A box written as a polygon.
  const TestShape box = Polygon({-1.5, -2, 1.5, -2, 1.5, 2, -1.5, 2});
  ExpectClose(UniformInertia(box.View(), 7.0), UniformInertia(Box(3, 4).View(), 7.0));
}

// The sums over edges hold for any simple outline: an L is the sum of the boxes [0, 2] x [0, 1] and
// [0, 1] x [1, 2], of areas 2 and 1 and second moments about the origin 10/3 and 8/3.
TEST(MassProperties, ConcaveOutline) {
  const TestShape outline = Polygon({0, 0, 2, 0, 2, 1, 1, 1, 1, 2, 0, 2});
  ExpectClose(Area(outline.View()), 3.0);
  ExpectClose(Centroid(outline.View()).x(), 5.0 / 6.0);
  ExpectClose(Centroid(outline.View()).y(), 5.0 / 6.0);
  ExpectClose(UniformInertia(outline.View(), 3.0), 6.0);
  ExpectClose(BoundingRadius(outline.View()), std::sqrt(5.0));
}

/// ∫ f over a capsule by the midpoint rule in polar coordinates of its caps and in its rectangle.
TEST(MassProperties, CapsuleIsTheIntegral) {
  const double length = 1.3;
  const double radius = 0.4;
  constexpr int kNumCells = 400;
  double area = 0.0;
  double second = 0.0;
  const auto add = [&](double x, double y, double cell) {
    area += cell;
    second += cell * (x * x + y * y);
  };
  for (int i = 0; i < kNumCells; ++i) {
    for (int j = 0; j < kNumCells; ++j) {
      const double u = (i + 0.5) / kNumCells;
      const double v = (j + 0.5) / kNumCells;
      add(length * (u - 0.5), radius * (2.0 * v - 1.0),
          2.0 * radius * length / kNumCells / kNumCells);
      const double angle = kPi * (v - 0.5);
      const double x = 0.5 * length + radius * u * std::cos(angle);
      add(x, radius * u * std::sin(angle), radius * u * radius * kPi / kNumCells / kNumCells);
      add(-x, radius * u * std::sin(angle), radius * u * radius * kPi / kNumCells / kNumCells);
    }
  }
  const TestShape capsule = Capsule(length, radius);
  // The midpoint rule is of second order: (1/400)² times constants below 2.
  EXPECT_NEAR(Area(capsule.View()), area, 1e-5 * area);
  EXPECT_NEAR(UniformInertia(capsule.View(), 3.0), 3.0 * second / area, 1e-5 * 3.0 * second / area);
  ExpectClose(BoundingRadius(capsule.View()), 0.5 * length + radius);
}

TEST(MassProperties, CapsuleLimits) {
  ExpectClose(UniformInertia(Capsule(2.0, 0.0).View(), 3.0), 1.0);  // a rod: m L²/12
  ExpectClose(UniformInertia(Capsule(0.0, 2.0).View(), 3.0), 6.0);  // a disc: m r²/2
}

TEST(MassProperties, HalfPlaneIsUnbounded) {
  EXPECT_TRUE(std::isinf(BoundingRadius(HalfPlane(0, 1, 0).View())));
  EXPECT_EQ(BoundingRadius(ShapeView<double>{}), 0.0);
}

TEST(MassProperties, JetsAgreeWithDifferences) {
  std::mt19937 random(20240301);
  const std::vector<TestShape> shapes = {Circle(0.7), Box(0.6, 1.1), Capsule(1.2, 0.3),
                                         RandomPolygon(&random, 5)};
  const double mass = 1.7;
  for (const TestShape& shape : shapes) {
    OwnedShape<LocalJet> jets{shape.type, {}};
    for (std::size_t i = 0; i < shape.numbers.size(); ++i) {
      jets.numbers.emplace_back(shape.numbers[i], static_cast<int>(i));
    }
    const LocalJet inertia = UniformInertia(jets.View(), LocalJet(mass, 15));
    const LocalJet area = Area(jets.View());
    ExpectClose(inertia.a, UniformInertia(shape.View(), mass));
    EXPECT_NEAR(inertia.v[15], inertia.a / mass, 1e-14);
    for (std::size_t i = 0; i < shape.numbers.size(); ++i) {
      const double h = 1e-5;
      TestShape up = shape;
      TestShape down = shape;
      up.numbers[i] += h;
      down.numbers[i] -= h;
      // Central differences: h² times third derivatives (below 50), and 1e-16 / h.
      EXPECT_NEAR(inertia.v[static_cast<int>(i)],
                  (UniformInertia(up.View(), mass) - UniformInertia(down.View(), mass)) / (2 * h),
                  1e-8);
      EXPECT_NEAR(area.v[static_cast<int>(i)], (Area(up.View()) - Area(down.View())) / (2 * h),
                  1e-8);
      EXPECT_NE(inertia.v[static_cast<int>(i)], 0.0);
    }
  }
}

}  // namespace
}  // namespace tangible::testing
