// SPDX-License-Identifier: Apache-2.0
//
// Ellipses against every other shape: the gap beside that of a polygon with many corners and beside
// closed forms, circles as ellipses, and the degenerate places.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "random_shapes.h"
#include "tangible/geometry/collide.h"
#include "tangible/geometry/ellipse.h"

namespace tangible::testing {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// An inscribed polygon: its border is off by at most (a² / b) (π / n)² / 2.
TestShape Inscribed(const TestShape& ellipse, int corners) {
  std::vector<double> vertices;
  for (int i = 0; i < corners; ++i) {
    const double anomaly = 2.0 * std::numbers::pi * i / corners;
    vertices.push_back(ellipse.numbers[0] * std::cos(anomaly));
    vertices.push_back(ellipse.numbers[1] * std::sin(anomaly));
  }
  return Polygon(vertices);
}

TEST(CollideEllipse, GapIsThatOfAPolygonWithManyCorners) {
  std::mt19937 random(20240701);
  constexpr int kCorners = 400;
  int apart = 0;
  int in_penetration = 0;
  int edges = 0;
  int corners = 0;
  for (int sample = 0; sample < 120; ++sample) {
    const TestShape ellipse = RandomEllipse(&random);
    const bool two = sample % 20 == 0;
    const TestShape other = two ? RandomEllipse(&random) : RandomShape(&random);
    const Pose<double> pose = RandomPose(&random, 1.2);
    const Pose<double> other_pose = RandomPose(&random, 1.2);
    const TestShape polygon = Inscribed(ellipse, kCorners);
    const TestShape other_polygon = two ? Inscribed(other, kCorners) : other;
    const double expected = SignedDistance(polygon, pose, other_polygon, other_pose);
    // Deep inside another face may be the way out.
    const double depth = std::fmin(ellipse.numbers[0], ellipse.numbers[1]);
    if (expected < -0.5 * depth) {
      continue;
    }
    const Contacts contacts = Collide(ellipse, pose, other, other_pose);
    const Contacts mirrored = Collide(other, other_pose, ellipse, pose);
    ASSERT_EQ(contacts.count, 1);
    ASSERT_EQ(mirrored.count, 1);
    // Aspects are at most 5, sizes at most 1.5.
    const double off = 1.5 * 5.0 * std::pow(std::numbers::pi / kCorners, 2);
    EXPECT_NEAR(contacts.geometry[0].gap, expected, off) << sample;
    EXPECT_EQ(mirrored.features[0], Mirrored(contacts.features[0]));
    EXPECT_NEAR(mirrored.geometry[0].gap, contacts.geometry[0].gap, 1e-14);
    EXPECT_NEAR((mirrored.geometry[0].normal + contacts.geometry[0].normal).norm(), 0.0, 1e-13);
    (expected > 0.0 ? apart : in_penetration) += 1;
    if (!two && NumVertices(other.type, static_cast<int>(other.numbers.size())) > 1) {
      (contacts.features[0].kind == FeatureKind::kVertexVertex ? corners : edges) += 1;
    }
  }
  for (const int count : {apart, in_penetration, edges, corners}) {
    EXPECT_GT(count, 10);
  }
}

TEST(CollideEllipse, OfEqualAxesIsACircle) {
  std::mt19937 random(20240702);
  for (int sample = 0; sample < 300; ++sample) {
    const double radius = Uniform(&random, 0.1, 1.0);
    const TestShape ellipse = Ellipse(radius, radius);
    const TestShape circle = Circle(radius);
    TestShape other = sample % 5 == 0   ? HalfPlane(0.6, -1.7, 0.4)
                      : sample % 5 == 1 ? RandomEllipse(&random)
                                        : RandomShape(&random);
    const Pose<double> pose = RandomPose(&random, 1.5);
    const Pose<double> other_pose = RandomPose(&random, 1.5);
    const Contacts of_circle = Collide(circle, pose, other, other_pose);
    // A centre within the other shape may have its way out over another face.
    if (of_circle.geometry[0].gap < -radius) {
      continue;
    }
    const Contacts of_ellipse = Collide(ellipse, pose, other, other_pose);
    ASSERT_EQ(of_ellipse.count, 1);
    EXPECT_EQ(of_ellipse.features[0], of_circle.features[0]);
    // Rounding of lengths up to 3 m; the normal's over the distance of the centres.
    const double distance = of_circle.geometry[0].gap + radius;
    EXPECT_NEAR(of_ellipse.geometry[0].gap, of_circle.geometry[0].gap, 32.0 * kEps);
    EXPECT_LE((of_ellipse.geometry[0].normal - of_circle.geometry[0].normal).norm(),
              32.0 * kEps * (1.0 + 1.0 / distance));
    EXPECT_LE((of_ellipse.geometry[0].point - of_circle.geometry[0].point).norm(),
              64.0 * kEps * (1.0 + 1.0 / distance));
  }
}

TEST(CollideEllipse, ClosedForms) {
  // h = √(a² n_x² + b² n_y²) against a half-plane, with the contact at (a² n_x, b² n_y) / h.
  const double angle = 0.4;
  const Contacts plane = Collide(Ellipse(0.5, 0.2), At(1, 2, angle), HalfPlane(0, 1, 0), At(0, 0));
  const double height = std::hypot(0.5 * std::sin(angle), 0.2 * std::cos(angle));
  ASSERT_EQ(plane.count, 1);
  EXPECT_NEAR(plane.geometry[0].gap, 2.0 - height, 4.0 * kEps);
  const double along = (0.25 - 0.04) * std::sin(angle) * std::cos(angle) / height;
  EXPECT_NEAR(plane.geometry[0].point.x(), 1.0 - along, 4.0 * kEps);
  // A circle's centre on the major axis between the evolute's cusps, x < (a² − b²) / a: the nearest
  // points lie at x a² / (a² − b²), above and below.
  const Contacts inside = Collide(Circle(0.1), At(0.5, 0), Ellipse(2, 1), At(0, 0));
  const double foot = 0.5 * 4.0 / 3.0;
  ASSERT_EQ(inside.count, 1);
  EXPECT_NEAR(inside.geometry[0].gap,
              -std::hypot(foot - 0.5, std::sqrt(1.0 - 0.25 * foot * foot)) - 0.1, 8.0 * kEps);
  // Beyond the cusp it is the apex.
  const Contacts apex = Collide(Circle(0.1), At(1.8, 0), Ellipse(2, 1), At(0, 0));
  EXPECT_NEAR(apex.geometry[0].gap, -0.3, 8.0 * kEps);
  EXPECT_NEAR(apex.geometry[0].normal.x(), 1.0, 4.0 * kEps);
  // On the minor axis.
  const Contacts side = Collide(Circle(0.1), At(0, -1.4), Ellipse(2, 1), At(0, 0));
  EXPECT_NEAR(side.geometry[0].gap, 0.3, 8.0 * kEps);
}

TEST(CollideEllipse, ConcentricCirclesHaveTheNormalUp) {
  for (const TestShape& other : {Circle(0.2), Ellipse(0.2, 0.2)}) {
    const Contacts contacts = Collide(Ellipse(0.5, 0.5), At(1, 1, 0.3), other, At(1, 1, -0.7));
    ASSERT_EQ(contacts.count, 1);
    EXPECT_EQ(contacts.geometry[0].normal, Vector2<double>(0.0, 1.0));
    EXPECT_NEAR(contacts.geometry[0].gap, -0.7, 4.0 * kEps);
  }
  // The cusp of the evolute: the direction is the apex's, without a derivative.
  const Contacts cusp = Collide(Circle(0.1), At(1.5, 0), Ellipse(2, 1), At(0, 0));
  EXPECT_NEAR(cusp.geometry[0].gap, -0.6, 1e-12);
  EXPECT_NEAR(std::abs(cusp.geometry[0].normal.x()), 1.0, 1e-4);
}

TEST(CollideEllipse, NeedlesHaveTheirClosedForms) {
  const TestShape needle = Ellipse(1.0, 1e-6);
  const auto gap = [&](double x, double y) {
    const Contacts contacts = Collide(Circle(0.1), At(x, y), needle, At(0, 0));
    EXPECT_EQ(contacts.count, 1);
    EXPECT_TRUE(std::isfinite(contacts.geometry[0].point.norm()));
    return contacts.geometry[0].gap;
  };
  EXPECT_NEAR(gap(0.0, 0.5), 0.4 - 1e-6, 8.0 * kEps);
  EXPECT_NEAR(gap(1.3, 0.0), 0.2, 8.0 * kEps);
  EXPECT_NEAR(gap(1.3, 0.4), 0.4, 1e-9);  // √(0.3² + 0.4²) − 0.1 from its tip
  // Two of them, crossed: apart, tip against side, and through each other.
  const auto crossed = [&](double x) {
    return Collide(needle, At(x, 0), needle, At(0, 0, 0.5 * std::numbers::pi)).geometry[0].gap;
  };
  EXPECT_NEAR(crossed(1.5), 0.5 - 1e-6, 1e-13);
  EXPECT_NEAR(crossed(0.75), -0.25 - 1e-6, 1e-11);
  EXPECT_TRUE(std::isfinite(crossed(0.0)));
}

TEST(CollideEllipse, RollsOverACornerWithoutAJump) {
  // An ellipse lies on a box with one contact, which moves over the corner: gap and normal do not
  // jump where the vertex takes over from the edge.
  const TestShape box = Box(2, 2);
  const TestShape ellipse = Ellipse(0.5, 0.2);
  EXPECT_EQ(Collide(ellipse, At(0.1, 1.2), box, At(0, 0)).count, 1);
  EXPECT_NEAR(Collide(ellipse, At(0.1, 1.2), box, At(0, 0)).geometry[0].gap, 0.0, 4.0 * kEps);
  double last = 0.0;
  int changes = 0;
  FeatureKind kind = FeatureKind::kVertexEdge;
  for (int i = 0; i <= 1000; ++i) {
    const Contacts contacts = Collide(ellipse, At(0.5 + 1e-3 * i, 1.4, -0.6), box, At(0, 0));
    ASSERT_EQ(contacts.count, 1);
    if (i > 0) {
      EXPECT_LE(std::abs(contacts.geometry[0].gap - last), 1.001e-3);
    }
    changes += contacts.features[0].kind != kind;
    kind = contacts.features[0].kind;
    last = contacts.geometry[0].gap;
  }
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(kind, FeatureKind::kVertexVertex);
}

TEST(CollideEllipse, BeyondReachThereIsNone) {
  EXPECT_EQ(Collide(Ellipse(0.5, 0.2), At(0, 1), HalfPlane(0, 1, 0), At(0, 0), 0.79).count, 0);
  EXPECT_EQ(Collide(Ellipse(0.5, 0.2), At(0, 1), HalfPlane(0, 1, 0), At(0, 0), 0.81).count, 1);
  EXPECT_EQ(Collide(Ellipse(0.5, 0.2), At(0, 1), Box(1, 1), At(0, 0), 0.29).count, 0);
  EXPECT_EQ(Collide(Ellipse(0.5, 0.2), At(0, 1), Box(1, 1), At(0, 0), 0.31).count, 1);
  EXPECT_EQ(Collide(Ellipse(0.5, 0.2), At(0, 1), {ShapeType::kNone, {}}, At(0, 0)).count, 0);
}

}  // namespace
}  // namespace tangible::testing
