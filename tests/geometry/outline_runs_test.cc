// SPDX-License-Identifier: Apache-2.0
//
// Outlines of polygons against other shapes and against each other: the nearest of all features
// against the distance of the two outlines, computed segment by segment, and against what convex
// polygons have.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tangible/geometry/outline.h"

namespace tangible {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kPi = 3.14159265358979323846;

using Numbers = std::vector<double>;

ShapeView<double> PolygonOf(const Numbers& numbers) {
  return {ShapeType::kPolygon, numbers.data(), static_cast<int>(numbers.size())};
}

struct NearestContact {
  double gap = kFar;
  ContactGeometry<double> contact;
  int count = 0;  ///< of contacts within 1e-9 of it
  void Take(const ContactGeometry<double>& other) {
    if (other.gap < gap) contact = other;
    gap = std::min(gap, other.gap);
  }
};

/// Of all pairs of runs.
NearestContact NearestOfRuns(const Numbers& a, const Pose<double>& pose_a, const Numbers& b,
                             const Pose<double>& pose_b) {
  const Outline first(PolygonOf(a)), second(PolygonOf(b));
  NearestContact nearest;
  for (int i = 0; i < first.num_runs(); ++i) {
    for (int j = 0; j < second.num_runs(); ++j) {
      ContactFeature features[2];
      const int count = FindFeaturesOfRuns({first, i, pose_a}, {second, j, pose_b}, kFar, features);
      for (int k = 0; k < count; ++k) {
        nearest.Take(EvaluateContact(features[k], PolygonOf(a), pose_a, PolygonOf(b), pose_b));
      }
    }
  }
  return nearest;
}

/// Of all runs of `a` with a shape.
NearestContact NearestOfShape(const Numbers& a, const Pose<double>& pose_a,
                              const ShapeView<double>& b, const Pose<double>& pose_b) {
  const Outline outline(PolygonOf(a));
  NearestContact nearest;
  for (int i = 0; i < outline.num_runs(); ++i) {
    ContactFeature features[2];
    const int count = FindOutlineFeatures(outline, i, PolygonOf(a), pose_a, b, pose_b,
                                          SeamSide::kFirst, nullptr, kFar, features);
    for (int k = 0; k < count; ++k) {
      nearest.Take(EvaluateContact(features[k], PolygonOf(a), pose_a, b, pose_b));
    }
  }
  return nearest;
}

double DistanceToSegment(const Vector2<double>& p, const Vector2<double>& from,
                         const Vector2<double>& to) {
  const Vector2<double> along = to - from;
  const double share = std::clamp(along.dot(p - from) / along.squaredNorm(), 0.0, 1.0);
  return (p - from - share * along).norm();
}

bool Cross(const Vector2<double>& a, const Vector2<double>& b, const Vector2<double>& c,
           const Vector2<double>& d) {
  const auto side = [](const Vector2<double>& x, const Vector2<double>& y,
                       const Vector2<double>& z) {
    return tangible::Cross(Vector2<double>(y - x), Vector2<double>(z - x)) > 0.0;
  };
  return side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
}

/// Whether a point is in a polygon, and the distance of two outlines; 0 where they cross or one is
/// in the other.
bool IsIn(const Numbers& a, const Pose<double>& pose, const Vector2<double>& x) {
  return Outline(PolygonOf(a)).Contains(pose.Inverse(x));
}
double Distance(const Numbers& a, const Pose<double>& pose_a, const Numbers& b,
                const Pose<double>& pose_b) {
  const int n = static_cast<int>(a.size()) / 2, m = static_cast<int>(b.size()) / 2;
  if (IsIn(a, pose_a, pose_b * Vertex(PolygonOf(b), 0)) ||
      IsIn(b, pose_b, pose_a * Vertex(PolygonOf(a), 0))) {
    return 0.0;
  }
  double distance = kFar;
  for (int i = 0; i < n; ++i) {
    const Vector2<double> p = pose_a * Vertex(PolygonOf(a), i);
    const Vector2<double> q = pose_a * Vertex(PolygonOf(a), (i + 1) % n);
    for (int j = 0; j < m; ++j) {
      const Vector2<double> r = pose_b * Vertex(PolygonOf(b), j);
      const Vector2<double> s = pose_b * Vertex(PolygonOf(b), (j + 1) % m);
      if (Cross(p, q, r, s)) return 0.0;
      distance = std::min({distance, DistanceToSegment(p, r, s), DistanceToSegment(q, r, s),
                           DistanceToSegment(r, p, q), DistanceToSegment(s, p, q)});
    }
  }
  return distance;
}

/// A star whose corners are turned in by up to `depth` of the radius.
Numbers RandomStar(double depth, std::mt19937* random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int corners = (depth > 0.0 ? 5 : 3) + static_cast<int>(5.0 * unit(*random));
  Numbers numbers;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * kPi * (i + 0.3 * unit(*random)) / corners;
    const double radius = 1.0 - depth * unit(*random);
    numbers.push_back(radius * std::cos(angle));
    numbers.push_back(radius * std::sin(angle));
  }
  return numbers;
}

TEST(OutlineRunsTest, TheNearestFeatureIsTheDistanceOfTwoOutlines) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int apart = 0, concave = 0;
  for (int k = 0; k < 4000; ++k) {
    const Numbers a = RandomStar(0.7, &random), b = RandomStar(0.7, &random);
    const double angle = 2.0 * kPi * unit(random), away = 0.8 + 1.4 * unit(random);
    const Pose<double> pose_a(Vector2<double>(0.3, -0.2), 2.0 * kPi * unit(random));
    const Pose<double> pose_b(
        pose_a.position + away * Vector2<double>(std::cos(angle), std::sin(angle)),
        2.0 * kPi * unit(random));
    const double distance = Distance(a, pose_a, b, pose_b);
    if (distance == 0.0) continue;
    ++apart;
    concave += IsConcavePolygon(PolygonOf(a)) && IsConcavePolygon(PolygonOf(b));
    EXPECT_NEAR(NearestOfRuns(a, pose_a, b, pose_b).gap, distance, 1e-12) << k;
    EXPECT_NEAR(NearestOfRuns(b, pose_b, a, pose_a).gap, distance, 1e-12) << k;
  }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(concave, 500);
}

// A capsule's distance is that of its core less its radius.
TEST(OutlineRunsTest, TheNearestFeatureIsTheDistanceOfAShape) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Numbers box = {0.5, 0.3}, capsule = {0.4, 0.05};
  const Numbers corners = {-0.25, -0.15, 0.25, -0.15, 0.25, 0.15, -0.25, 0.15};
  const Numbers core = {-0.2, 0.0, 0.2, 0.0};
  int apart = 0;
  for (int k = 0; k < 4000; ++k) {
    const Numbers a = RandomStar(0.7, &random);
    const double angle = 2.0 * kPi * unit(random), away = 0.5 + 0.9 * unit(random);
    const Pose<double> pose_a(Vector2<double>(0.3, -0.2), 2.0 * kPi * unit(random));
    const Pose<double> pose(
        pose_a.position + away * Vector2<double>(std::cos(angle), std::sin(angle)),
        2.0 * kPi * unit(random));
    const double of_box = Distance(a, pose_a, corners, pose);
    if (of_box > 0.0) {
      ++apart;
      EXPECT_NEAR(NearestOfShape(a, pose_a, {ShapeType::kBox, box.data(), 2}, pose).gap, of_box,
                  1e-12);
    }
    const double of_core = Distance(a, pose_a, core, pose);
    if (of_core > 0.0) {
      EXPECT_NEAR(NearestOfShape(a, pose_a, {ShapeType::kCapsule, capsule.data(), 2}, pose).gap,
                  of_core - 0.05, 1e-12);
    }
  }
  EXPECT_GT(apart, 1000);
}

// Convex polygons that penetrate each other a little have the same contact as by their separating
// axis, but for a few where two corners are in each other, each of them nearest to another edge.
TEST(OutlineRunsTest, ConvexPolygonsHaveTheContactOfTheirCores) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int compared = 0, of_corners = 0;
  for (int k = 0; k < 4000; ++k) {
    const Numbers a = RandomStar(0.0, &random), b = RandomStar(0.0, &random);
    const double angle = 2.0 * kPi * unit(random), away = 1.2 + 0.9 * unit(random);
    const Pose<double> pose_a(Vector2<double>(0.0, 0.0), 2.0 * kPi * unit(random));
    const Pose<double> pose_b(away * Vector2<double>(std::cos(angle), std::sin(angle)),
                              2.0 * kPi * unit(random));
    ContactFeature features[2];
    const int count =
        FindContactFeatures(PolygonOf(a), pose_a, PolygonOf(b), pose_b, kFar, features);
    ASSERT_GT(count, 0);
    const ContactGeometry<double> by_cores =
        EvaluateContact(features[0], PolygonOf(a), pose_a, PolygonOf(b), pose_b);
    // Where edges cross near two corners, no corner is behind the face of the separating axis.
    if (by_cores.gap < -0.01) continue;
    const NearestContact by_runs = NearestOfRuns(a, pose_a, b, pose_b);
    if (by_cores.gap < 0.0 && by_runs.gap == kFar) continue;
    ++compared;
    if (by_cores.gap < 0.0 && std::abs(by_runs.gap - by_cores.gap) > 1e-12) {
      EXPECT_NEAR(by_runs.gap, by_cores.gap, 0.01) << k;
      ++of_corners;
      continue;
    }
    EXPECT_NEAR(by_runs.gap, by_cores.gap, 1e-12) << k;
    EXPECT_NEAR((by_runs.contact.normal - by_cores.normal).norm(), 0.0, 1e-9) << k;
  }
  EXPECT_GT(compared, 1500);
  EXPECT_LE(of_corners, 5);
}

// Two faces of which each ends over the other one have two contacts, whichever corners end the
// overlap, and also where the corners lie above each other.
TEST(OutlineRunsTest, FacesHaveTheTwoEndsOfTheirOverlap) {
  const Numbers square = {-0.5, -0.5, 0.5, -0.5, 0.5, 0.5, -0.5, 0.5};
  const Numbers wide = {-1.0, -0.5, 1.0, -0.5, 1.0, 0.5, -1.0, 0.5};
  for (const Numbers& above : {square, wide}) {
    for (const double x : {0.0, 0.3, -0.3}) {
      for (const double angle : {0.0, 1e-7, -1e-3}) {
        const Outline low(PolygonOf(square)), high(PolygonOf(above));
        const Pose<double> pose_low(Vector2<double>(0.0, 0.0), 0.0);
        const Pose<double> pose_high(Vector2<double>(x, 1.01), angle);
        std::vector<double> places;
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j) {
            ContactFeature features[2];
            const int count =
                FindFeaturesOfRuns({low, i, pose_low}, {high, j, pose_high}, 0.05, features);
            for (int k = 0; k < count; ++k) {
              places.push_back(EvaluateContact(features[k], PolygonOf(square), pose_low,
                                               PolygonOf(above), pose_high)
                                   .point.x());
            }
          }
        }
        std::sort(places.begin(), places.end());
        const double half = above == wide ? 1.0 : 0.5;
        ASSERT_EQ(places.size(), 2u) << x << " " << angle << " " << half;
        EXPECT_NEAR(places[0], std::max(-0.5, x - half), 2e-3);
        EXPECT_NEAR(places[1], std::min(0.5, x + half), 2e-3);
      }
    }
  }
}

TEST(OutlineRunsTest, WhatIsInAConcavePolygonIsOverItsNearestEdge) {
  // An L of legs of 1 m.
  const Numbers corner = {0, 0, 3, 0, 3, 1, 1, 1, 1, 3, 0, 3};
  const Outline outline(PolygonOf(corner));
  EXPECT_TRUE(IsConcavePolygon(PolygonOf(corner)));
  const auto runs = [&](double x, double y) {
    std::vector<int> over;
    for (int i = 0; i < outline.num_runs(); ++i) {
      const double h = outline.run(i).normal.dot(Vector2<double>(x, y) - outline.run(i).start);
      if (h < 0.0 && outline.IsOver(i, Vector2<double>(x, y))) over.push_back(i);
    }
    return over;
  };
  EXPECT_EQ(runs(2.0, 0.7), std::vector<int>{2});
  EXPECT_EQ(runs(2.0, 0.3), std::vector<int>{0});
  EXPECT_EQ(runs(0.7, 2.0), std::vector<int>{3});
  EXPECT_EQ(runs(0.1, 2.0), std::vector<int>{5});
  EXPECT_EQ(runs(2.9, 0.5), std::vector<int>{1});
  // Behind both edges of the notch, and outside on all sides.
  EXPECT_EQ(runs(0.9, 0.8), (std::vector<int>{2, 3}));
  for (const auto& [x, y] :
       {std::pair(2.0, 2.0), {-0.1, 1.0}, {4.0, 0.5}, {0.5, 3.1}, {2.0, -9.0}}) {
    EXPECT_TRUE(runs(x, y).empty()) << x << " " << y;
    EXPECT_FALSE(outline.Contains(Vector2<double>(x, y)));
  }
  EXPECT_TRUE(outline.Contains(Vector2<double>(0.5, 1.0)));
}

TEST(OutlineRunsTest, AHalfPlaneTouchesTheCornersOfTheHull) {
  // An arch, whose feet stand on the plane; its inner edge does not, nor do corners that are not
  // below others.
  const Numbers arch = {-2, 0, -1, 0, -1, 1, 1, 1, 1, 0, 2, 0, 2, 2, -2, 2};
  const Outline outline(PolygonOf(arch));
  EXPECT_EQ(outline.hull_runs(), (std::vector<int>{0, 1, 4, 5, 6, 7}));
  const Numbers plane = {0.0, 1.0, 0.0};
  const Pose<double> at_rest(Vector2<double>(0.0, 0.0), 0.0);
  for (const double angle : {0.0, 1e-3, -1e-3}) {
    const Pose<double> pose(Vector2<double>(0.0, 0.01), angle);
    std::vector<int> vertices;
    for (const int run : outline.hull_runs()) {
      ContactFeature features[2];
      if (FindPlaneFeature(outline, run, {ShapeType::kHalfPlane, plane.data(), 3}, pose, at_rest,
                           SeamSide::kFirst, 1.0, features) == 0) {
        continue;
      }
      EXPECT_EQ(features[0].kind, FeatureKind::kVertexPlane);
      vertices.push_back(features[0].a);
    }
    EXPECT_EQ(vertices, (std::vector<int>{0, 1, 4, 5}));
  }
  // Feet that are shorter by a millionth count, by a hundredth not.
  Numbers uneven = arch;
  uneven[3] = 3e-6;
  EXPECT_EQ(Outline(PolygonOf(uneven)).hull_runs().size(), 6u);
  uneven[3] = 0.02;
  EXPECT_EQ(Outline(PolygonOf(uneven)).hull_runs().size(), 5u);
  EXPECT_FALSE(IsConcavePolygon({ShapeType::kPolygon, arch.data() + 8, 6}));
}

}  // namespace
}  // namespace tangible
