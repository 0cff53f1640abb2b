// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/outline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace tangible {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct RunContacts {
  ContactFeature features[2];
  ContactGeometry<double> contacts[2];
  int count = 0;
};

/// A shape at a pose against one run of a polyline at rest at the origin, as the second body.
RunContacts CollideRun(const std::vector<double>& points, int run, ShapeType type,
                       const std::vector<double>& numbers, double x, double y, double angle = 0.0) {
  const ShapeView<double> line{ShapeType::kPolyline, points.data(),
                               static_cast<int>(points.size())};
  const ShapeView<double> shape{type, numbers.data(), static_cast<int>(numbers.size())};
  const Pose<double> frame;
  const Pose<double> pose(Vector2<double>(x, y), angle);
  RunContacts found;
  found.count = FindOutlineFeatures(Outline(line), run, shape, pose, line, frame, SeamSide::kSecond,
                                    nullptr, kInfinity, found.features);
  for (int k = 0; k < found.count; ++k) {
    found.contacts[k] = EvaluateContact(found.features[k], shape, pose, line, frame);
  }
  return found;
}

RunContacts DiscOver(const std::vector<double>& points, int run, double x, double y) {
  return CollideRun(points, run, ShapeType::kCircle, {0.1}, x, y);
}

// Going towards −x the free side is above.
const std::vector<double> kFloorPoints = {2, 0, 1, 0, 0, 0, -2, 0};
const std::vector<double> kRidge = {2, -2, 0, 0, -2, -2};
const std::vector<double> kValley = {2, 2, 0, 0, -2, 2};

TEST(OutlineTest, EdgesThatDoNotTurnAreOneRun) {
  const ShapeView<double> line{ShapeType::kPolyline, kFloorPoints.data(), 8};
  const Outline outline(line);
  ASSERT_EQ(outline.num_runs(), 1);
  EXPECT_EQ(outline.run(0).length, 4.0);
  EXPECT_EQ(outline.EdgeAt(0, -1.0), 0);
  EXPECT_EQ(outline.EdgeAt(0, 0.5), 0);
  EXPECT_EQ(outline.EdgeAt(0, 1.5), 1);
  EXPECT_EQ(outline.EdgeAt(0, 3.0), 2);
  EXPECT_EQ(outline.EdgeAt(0, 9.0), 2);
  EXPECT_EQ(outline.run(0).normal.y(), 1.0);
}

TEST(OutlineTest, ADiscTouchesTheEdgeUnderItsCentreOnBothSides) {
  for (const double y : {0.3, 0.05, -0.4}) {
    const RunContacts found = DiscOver(kFloorPoints, 0, -1.5, y);
    ASSERT_EQ(found.count, 1);
    EXPECT_EQ(found.features[0], (ContactFeature{FeatureKind::kVertexEdge, 0, 2}));
    EXPECT_NEAR(found.contacts[0].gap, y - 0.1, 1e-15);
    EXPECT_EQ(found.contacts[0].normal.y(), 1.0);
  }
  // Nearer to the end than to the line it is beside the end, and below it on no free side.
  EXPECT_EQ(DiscOver(kFloorPoints, 0, -1.5, -0.7).count, 0);
  EXPECT_EQ(DiscOver(kFloorPoints, 0, 0.0, -0.7).count, 1);
}

TEST(OutlineTest, AnEndIsACornerOnTheFreeSideAlone) {
  const RunContacts above = DiscOver(kFloorPoints, 0, 2.3, 0.4);
  ASSERT_EQ(above.count, 1);
  EXPECT_EQ(above.features[0], (ContactFeature{FeatureKind::kVertexVertex, 0, 0}));
  EXPECT_NEAR(above.contacts[0].gap, 0.4, 1e-15);
  EXPECT_EQ(DiscOver(kFloorPoints, 0, -2.3, 0.4).count, 1);
  EXPECT_EQ(DiscOver(kFloorPoints, 0, 2.3, -0.4).count, 0);
  EXPECT_EQ(DiscOver(kFloorPoints, 0, -2.3, -0.4).count, 0);
}

// Around a ridge each place belongs to one edge or to the corner, as far as its distance says.
TEST(OutlineTest, EachPlaceAroundARidgeHasOneFeature) {
  for (int i = 0; i < 360; ++i) {
    const double angle = (i + 0.25) * std::acos(-1.0) / 180.0;
    const double x = 0.5 * std::cos(angle), y = 0.5 * std::sin(angle);
    const RunContacts right = DiscOver(kRidge, 0, x, y);
    const RunContacts left = DiscOver(kRidge, 1, x, y);
    ASSERT_EQ(right.count + left.count, 1) << i;
    const double h = (std::abs(x) + y) / std::sqrt(2.0);
    const bool is_corner = i >= 45 && i < 135;
    EXPECT_NEAR((right.count > 0 ? right : left).contacts[0].gap, (is_corner ? 0.5 : h) - 0.1,
                1e-12)
        << i;
  }
}

TEST(OutlineTest, BothEdgesOfAValleyHoldADisc) {
  for (const double y : {0.2, -0.3}) {
    const double gap = y / std::sqrt(2.0) - 0.1;
    for (const int run : {0, 1}) {
      const RunContacts found = DiscOver(kValley, run, 0.0, y);
      ASSERT_EQ(found.count, 1) << y;
      EXPECT_NE(found.features[0].kind, FeatureKind::kVertexVertex);
      EXPECT_NEAR(found.contacts[0].gap, gap, 1e-15);
    }
  }
}

TEST(OutlineTest, TheFarSideOfAThinSolidIsNoContact) {
  const std::vector<double> slab = {-1, -0.02, 1, -0.02, 1, 0, -1, 0, -1, -0.02};
  const ShapeView<double> line{ShapeType::kPolyline, slab.data(), 10};
  ASSERT_EQ(Outline(line).num_runs(), 4);
  EXPECT_EQ(DiscOver(slab, 0, 0.0, 0.08).count, 0);
  const RunContacts top = DiscOver(slab, 2, 0.0, 0.08);
  ASSERT_EQ(top.count, 1);
  EXPECT_NEAR(top.contacts[0].gap, -0.02, 1e-15);
  // In the solid the nearer side acts.
  EXPECT_EQ(DiscOver(slab, 0, 0.0, -0.015).count, 1);
}

// A box beside an end has one corner on the edge, and its face on the end.
TEST(OutlineTest, ABoxOverAnEnd) {
  const RunContacts found = CollideRun(kFloorPoints, 0, ShapeType::kBox, {1.0, 0.2}, 2.1, 0.1);
  ASSERT_EQ(found.count, 2);
  EXPECT_NEAR(found.contacts[0].gap, 0.0, 1e-15);
  EXPECT_NEAR(found.contacts[1].gap, 0.0, 1e-15);
  EXPECT_NEAR(found.contacts[0].point.x() + found.contacts[1].point.x(), 1.6 + 2.0, 1e-12);
  const RunContacts over = CollideRun(kFloorPoints, 0, ShapeType::kBox, {1.0, 0.2}, 0.1, 0.1);
  ASSERT_EQ(over.count, 2);
  EXPECT_EQ(over.features[0].kind, FeatureKind::kVertexEdge);
  EXPECT_EQ(over.features[1].kind, FeatureKind::kVertexEdge);
}

TEST(OutlineTest, ABoxOnARidgeRestsOnTheCorner) {
  const RunContacts found = CollideRun(kRidge, 1, ShapeType::kBox, {1.0, 0.2}, 0.1, 0.09);
  ASSERT_GE(found.count, 1);
  EXPECT_EQ(found.features[0].kind, FeatureKind::kEdgeVertex);
  EXPECT_NEAR(found.contacts[0].gap, -0.01, 1e-15);
  EXPECT_NEAR(found.contacts[0].normal.y(), 1.0, 1e-15);
}

TEST(OutlineTest, EllipsesOverEdgesAndCorners) {
  const RunContacts over = CollideRun(kFloorPoints, 0, ShapeType::kEllipse, {0.2, 0.1}, 0.5, 0.3);
  ASSERT_EQ(over.count, 1);
  EXPECT_NEAR(over.contacts[0].gap, 0.2, 1e-15);
  const RunContacts corner = CollideRun(kRidge, 1, ShapeType::kEllipse, {0.2, 0.1}, 0.0, 0.3);
  ASSERT_EQ(corner.count, 1);
  EXPECT_EQ(corner.features[0].kind, FeatureKind::kVertexVertex);
  EXPECT_NEAR(corner.contacts[0].gap, 0.2, 1e-12);
}

TEST(OutlineTest, TheTreeFindsTheRunsNearABoxInOrder) {
  std::vector<double> points;
  for (int i = 0; i < 1000; ++i) {
    points.push_back(-i);
    points.push_back(i % 2);
  }
  const Outline outline(ShapeView<double>{ShapeType::kPolyline, points.data(), 2000});
  ASSERT_EQ(outline.num_runs(), 999);
  std::vector<int> found;
  outline.ForEachRun({-500.5, 0.0, -498.5, 1.0}, [&](int run) { found.push_back(run); });
  EXPECT_EQ(found, (std::vector<int>{498, 499, 500}));
}

TEST(OutlineTest, TheDistanceOfARunIsThatOfTheNearestPoints) {
  const ShapeView<double> line{ShapeType::kPolyline, kFloorPoints.data(), 8};
  const std::vector<double> size = {1.0, 0.2};
  const ShapeView<double> box{ShapeType::kBox, size.data(), 2};
  int corner = -1, vertex = -1;
  EXPECT_NEAR(DistanceOfRun(Outline(line), 0, Pose<double>(), box,
                            Pose<double>(Vector2<double>(3.0, -0.05), 0.0), &corner, &vertex),
              0.5, 1e-15);
  EXPECT_EQ(corner, 0);
  const auto distance = [&](double x, double y) {
    return DistanceOfRun(Outline(line), 0, Pose<double>(), box,
                         Pose<double>(Vector2<double>(x, y), 0.0), &corner, &vertex);
  };
  // Its lower face on the line of the run, beyond its end; across the run.
  EXPECT_NEAR(distance(3.0, 0.1), 0.5, 1e-15);
  EXPECT_EQ(distance(1.5, 0.0), 0.0);
}

}  // namespace
}  // namespace tangible
