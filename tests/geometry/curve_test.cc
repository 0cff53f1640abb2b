// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tangible/geometry/contact_geometry_adjoint.h"
#include "tangible/geometry/spline_inl.h"
#include "tangible/math/scalar.h"
#include "tangible/math/spline_curve.h"

namespace tangible {
namespace {

/// The numbers of a spline: its points, of a closed one the first again at the end, and the second
/// derivatives there.
std::vector<double> SplineNumbers(std::vector<double> points) {
  const std::vector<double> m = SplineCurvatures(points);
  points.insert(points.end(), m.begin(), m.end());
  return points;
}

ShapeView<double> SplineView(const std::vector<double>& numbers) {
  return {ShapeType::kSpline, numbers.data(), static_cast<int>(numbers.size())};
}

/// A closed curve about the origin, counter-clockwise and wavy; `inward`: its solid is outside.
std::vector<double> WavyLoop(int count, bool inward) {
  std::vector<double> points;
  for (int i = 0; i <= count; ++i) {
    const double angle = (inward ? -1.0 : 1.0) * 2.0 * std::numbers::pi * (i % count) / count;
    const double radius = 1.0 + 0.25 * std::cos(3.0 * angle) + 0.1 * std::sin(5.0 * angle + 0.3);
    points.push_back(radius * std::cos(angle));
    points.push_back(radius * std::sin(angle));
  }
  return points;
}

/// y = x² from −1 to 1, whose chords have the same length, with the solid below.
const std::vector<double> kParabola = SplineNumbers({1.0, 1.0, 0.0, 0.0, -1.0, 1.0});

struct CurveContacts {
  ContactFeature features[2];
  ContactGeometry<double> contacts[2];
  int count = 0;
};

CurveContacts CollideCurve(const std::vector<double>& spline, const Pose<double>& frame,
                           ShapeType type, const std::vector<double>& numbers,
                           const Pose<double>& pose, double max_gap) {
  const ShapeView<double> line = SplineView(spline);
  const ShapeView<double> shape{type, numbers.data(), static_cast<int>(numbers.size())};
  const Curve curve(line);
  CurveContacts found;
  found.count =
      FindCurveFeatures({curve, frame}, {shape, pose, 0, NumVertices(type, shape.num_numbers)},
                        SeamSide::kSecond, max_gap, found.features);
  for (int k = 0; k < found.count; ++k) {
    EXPECT_EQ(FeatureAt(found.features[k], shape, pose, line, frame), found.features[k]);
    found.contacts[k] = EvaluateContact(found.features[k], shape, pose, line, frame);
  }
  return found;
}

/// The least distance of a point from points close to each other on a curve.
double SampledDistance(const std::vector<double>& spline, const Vector2<double>& x) {
  const ShapeView<double> line = SplineView(spline);
  double best = kInfinity;
  for (int i = 0; i + 1 < NumVertices(line.type, line.num_numbers); ++i) {
    const SplinePiece<double> piece = internal::PieceOf(line, i);
    for (int k = 0; k <= 400; ++k) {
      best = std::min(best, (x - piece.At(piece.length * k / 400).place).norm());
    }
  }
  return best;
}

TEST(CurveTest, TheNearestPointIsThatOfSamples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1.6, 1.6);
  for (const bool inward : {false, true}) {
    const std::vector<double> spline = SplineNumbers(WavyLoop(40, inward));
    const Curve curve(SplineView(spline));
    int in_solid = 0;
    for (int k = 0; k < 200; ++k) {
      const Vector2<double> x(place(random), place(random));
      const Curve::Nearest nearest = curve.FindNearest(x);
      EXPECT_NEAR(nearest.distance, SampledDistance(spline, x), 1e-4);
      const double angle = std::atan2(x.y(), x.x());
      const double radius = 1.0 + 0.25 * std::cos(3.0 * angle) + 0.1 * std::sin(5.0 * angle + 0.3);
      if (std::abs(x.norm() - radius) < 0.01) continue;
      EXPECT_EQ(nearest.minimum.height < 0.0, (x.norm() < radius) != inward);
      in_solid += nearest.minimum.height < 0.0 ? 1 : 0;
    }
    EXPECT_GT(in_solid, 20);
  }
}

TEST(CurveTest, ADiscOnAParabola) {
  // At (t, t²) the normal is (−2t, 1)/√(1 + 4t²).
  const double t = 0.37, root = std::sqrt(1.0 + 4.0 * t * t), radius = 0.2, gap = 0.01;
  const Vector2<double> normal(-2.0 * t / root, 1.0 / root);
  const Vector2<double> foot(t, t * t);
  const Pose<double> pose(Vector2<double>(foot + (radius + gap) * normal), 0.4);
  const CurveContacts found =
      CollideCurve(kParabola, Pose<double>(), ShapeType::kCircle, {radius}, pose, 0.1);
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.contacts[0].gap, gap, 1e-15);
  EXPECT_NEAR((found.contacts[0].normal - normal).norm(), 0.0, 1e-15);
  EXPECT_NEAR((found.contacts[0].point - foot - 0.5 * gap * normal).norm(), 0.0, 1e-15);
}

// A disc whose radius is larger than that of curvature at the bottom, 1/2, touches both sides at
// the height of its centre less 1/2.
TEST(CurveTest, ALargeDiscTouchesBothSides) {
  const double height = 1.0, x = std::sqrt(height - 0.5);
  const double distance = std::hypot(x, height - x * x);
  const CurveContacts found =
      CollideCurve(kParabola, Pose<double>(), ShapeType::kCircle, {distance - 0.01},
                   Pose<double>(Vector2<double>(0.0, height), 0.0), 0.1);
  ASSERT_EQ(found.count, 2);
  for (const ContactGeometry<double>& contact : found.contacts) {
    EXPECT_NEAR(contact.gap, 0.01, 1e-14);
    EXPECT_NEAR(std::abs(contact.normal.x()), x / distance, 1e-14);
  }
  EXPECT_LT(found.contacts[0].normal.x() * found.contacts[1].normal.x(), 0.0);
}

TEST(CurveTest, WhatIsDeepInTheSolidHasTheNearestContactAlone) {
  for (const double depth : {1e-7, 0.1, 3.0}) {
    const CurveContacts found = CollideCurve(kParabola, Pose<double>(), ShapeType::kCircle, {0.1},
                                             Pose<double>(Vector2<double>(0.0, -depth), 0.0), 0.1);
    ASSERT_EQ(found.count, 1);
    EXPECT_NEAR(found.contacts[0].gap, -depth - 0.1, 1e-14);
    EXPECT_NEAR(found.contacts[0].normal.y(), 1.0, 1e-14);
  }
  // Beyond an end there is no wall.
  EXPECT_EQ(CollideCurve(kParabola, Pose<double>(), ShapeType::kCircle, {0.1},
                         Pose<double>(Vector2<double>(2.5, 0.5), 0.0), kInfinity)
                .count,
            0);
}

TEST(CurveTest, AnOpenEndIsACorner) {
  const Vector2<double> end(1.0, 1.0);
  const Vector2<double> along(1.0 / std::sqrt(5.0), 2.0 / std::sqrt(5.0));
  const Vector2<double> direction = (along + 0.5 * Perp(along)).normalized();
  const CurveContacts found =
      CollideCurve(kParabola, Pose<double>(), ShapeType::kCircle, {0.1},
                   Pose<double>(Vector2<double>(end + 0.15 * direction), 0.0), 0.1);
  ASSERT_EQ(found.count, 1);
  EXPECT_EQ(found.features[0].kind, FeatureKind::kVertexVertex);
  EXPECT_NEAR(found.contacts[0].gap, 0.05, 1e-14);
  EXPECT_NEAR((found.contacts[0].normal - direction).norm(), 0.0, 1e-14);
}

// A box has its two lowest corners, an ellipse one point whose normal is that of the curve.
TEST(CurveTest, CornersAndEllipses) {
  const CurveContacts box = CollideCurve(kParabola, Pose<double>(), ShapeType::kBox, {0.6, 0.4},
                                         Pose<double>(Vector2<double>(0.0, 0.35), 0.0), 0.1);
  ASSERT_EQ(box.count, 2);
  EXPECT_NEAR(box.contacts[0].gap, box.contacts[1].gap, 1e-15);
  EXPECT_LT(box.contacts[0].gap, 0.15 - 0.09);
  const Pose<double> pose(Vector2<double>(0.3, 0.5), 0.7);
  const CurveContacts ellipse =
      CollideCurve(kParabola, Pose<double>(), ShapeType::kEllipse, {0.3, 0.1}, pose, 1.0);
  ASSERT_GE(ellipse.count, 1);
  double best = kInfinity;
  for (int k = 0; k < 20000; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / 20000;
    const Vector2<double> x = pose * Vector2<double>(0.3 * std::cos(angle), 0.1 * std::sin(angle));
    best = std::min(best, SampledDistance(kParabola, x));
  }
  EXPECT_NEAR(ellipse.contacts[0].gap, best, 1e-5);
}

/// Gap, normal and point of the contact of a disc or another shape with a moved wavy loop, with
/// variables for both poses and all numbers that the feature reads.
template <typename T>
struct MovedContact {
  std::vector<T> numbers, spline;
  ContactFeature feature;
  ContactGeometry<T> At(const std::vector<T>& poses) const {
    const ShapeView<T> shape{type, numbers.data(), static_cast<int>(numbers.size())};
    const ShapeView<T> line{ShapeType::kSpline, spline.data(), static_cast<int>(spline.size())};
    const Pose<T> a(Vector2<T>(poses[0], poses[1]), poses[2]);
    const Pose<T> b(Vector2<T>(poses[3], poses[4]), poses[5]);
    return EvaluateContact(FeatureAt(feature, shape, a, line, b), shape, a, line, b);
  }
  ShapeType type = ShapeType::kCircle;
};

std::vector<double> Flatten(const ContactGeometry<double>& geometry) {
  return {geometry.gap, geometry.normal.x(), geometry.normal.y(), geometry.point.x(),
          geometry.point.y()};
}

// Jets agree with differences of fourth order, and the adjoint with Jets, for all that is read.
TEST(CurveTest, DerivativesAgree) {
  for (const ShapeType type : {ShapeType::kCircle, ShapeType::kBox, ShapeType::kCapsule,
                               ShapeType::kPolygon, ShapeType::kEllipse}) {
    SCOPED_TRACE(static_cast<int>(type));
    MovedContact<double> own;
    own.type = type;
    own.numbers = type == ShapeType::kCircle ? std::vector<double>{0.2}
                  : type == ShapeType::kPolygon
                      ? std::vector<double>{-0.2, -0.1, 0.2, -0.15, 0.05, 0.2}
                      : std::vector<double>{0.3, 0.2};
    own.spline = SplineNumbers(WavyLoop(24, true));
    const std::vector<double> poses = {0.9, 0.45, 0.3, 0.3, -0.2, 0.8};
    const ShapeView<double> shape{type, own.numbers.data(), static_cast<int>(own.numbers.size())};
    const ShapeView<double> line = SplineView(own.spline);
    const Pose<double> a(Vector2<double>(poses[0], poses[1]), poses[2]);
    const Pose<double> b(Vector2<double>(poses[3], poses[4]), poses[5]);
    const Curve curve(line);
    ContactFeature features[2];
    ASSERT_GE(FindCurveFeatures({curve, b}, {shape, a, 0, NumVertices(type, shape.num_numbers)},
                                SeamSide::kSecond, kInfinity, features),
              1);
    own.feature = features[0];
    int used_a[kMostFeatureNumbers], used_b[kMostFeatureNumbers];
    const int of_a = FeatureNumbers(type, shape.num_numbers, false, own.feature.a, used_a);
    const int of_b =
        FeatureNumbers(ShapeType::kSpline, line.num_numbers, true, own.feature.b, used_b);
    ASSERT_LE(6 + of_a + of_b, kLocalJetWidth);
    MovedContact<LocalJet> jets;
    jets.type = type;
    jets.feature = own.feature;
    for (const double x : own.numbers) jets.numbers.emplace_back(x);
    for (const double x : own.spline) jets.spline.emplace_back(x);
    std::vector<LocalJet> local;
    int next = 0;
    for (const double x : poses) local.emplace_back(x, next++);
    for (int i = 0; i < of_a; ++i) jets.numbers[used_a[i]].v[next++] = 1.0;
    for (int i = 0; i < of_b; ++i) jets.spline[used_b[i]].v[next++] = 1.0;
    const ContactGeometry<LocalJet> exact = jets.At(local);
    const LocalJet* const outputs[5] = {&exact.gap, &exact.normal.x(), &exact.normal.y(),
                                        &exact.point.x(), &exact.point.y()};
    for (int k = 0; k < next; ++k) {
      const auto moved = [&](double step) {
        MovedContact<double> other = own;
        std::vector<double> at = poses;
        (k < 6          ? at[k]
         : k < 6 + of_a ? other.numbers[used_a[k - 6]]
                        : other.spline[used_b[k - 6 - of_a]]) += step;
        return Flatten(other.At(at));
      };
      const double h = 1e-4;
      const std::vector<double> p = moved(h), m = moved(-h), pp = moved(2 * h), mm = moved(-2 * h);
      for (int o = 0; o < 5; ++o) {
        const double slope = (8.0 * (p[o] - m[o]) - (pp[o] - mm[o])) / (12.0 * h);
        EXPECT_NEAR(outputs[o]->v[k], slope, 1e-9 * (1.0 + std::abs(slope))) << o << " by " << k;
      }
    }
    ContactGeometry<double> bar;
    bar.gap = 0.7;
    bar.normal = Vector2<double>(-0.4, 1.1);
    bar.point = Vector2<double>(0.9, 0.2);
    ContactSideAdjoint a_bar, b_bar;
    EvaluateContactAdjoint(own.feature, shape, a, line, b, bar, &a_bar, &b_bar);
    const double weights[5] = {0.7, -0.4, 1.1, 0.9, 0.2};
    for (int k = 0; k < next; ++k) {
      double sum = 0.0;
      for (int o = 0; o < 5; ++o) sum += weights[o] * outputs[o]->v[k];
      const double by_adjoint = k < 3          ? a_bar.pose[k]
                                : k < 6        ? b_bar.pose[k - 3]
                                : k < 6 + of_a ? a_bar.numbers[k - 6]
                                               : b_bar.numbers[k - 6 - of_a];
      EXPECT_NEAR(by_adjoint, sum, 1e-12 * (1.0 + std::abs(sum))) << k;
    }
  }
}

// A contact that has moved far along the curve, over the closing point too, is still the same.
TEST(CurveTest, AContactMovesAlongTheCurve) {
  const std::vector<double> spline = SplineNumbers(WavyLoop(60, true));
  const ShapeView<double> line = SplineView(spline);
  const double radius = 0.1;
  const ShapeView<double> disc{ShapeType::kCircle, &radius, 1};
  const auto on = [&](double angle) {
    const double r = 0.9 * (1.0 + 0.25 * std::cos(3.0 * angle) + 0.1 * std::sin(5.0 * angle + 0.3));
    return Pose<double>(Vector2<double>(r * std::cos(angle), r * std::sin(angle)), 0.0);
  };
  const Curve curve(line);
  const auto feature = [&](double angle) {
    ContactFeature features[2];
    const Pose<double> pose = on(angle);
    EXPECT_GE(FindCurveFeatures({curve, Pose<double>()}, {disc, pose, 0, 1}, SeamSide::kSecond,
                                kInfinity, features),
              1);
    return features[0];
  };
  for (const double from : {0.5, 6.2}) {
    for (const double way : {0.05, -0.05, 0.2, -0.2}) {
      ContactFeature moved = feature(from);
      moved = FeatureAt(moved, disc, on(from + way), line, Pose<double>());
      EXPECT_EQ(moved, feature(from + way)) << from << " " << way;
    }
  }
  EXPECT_FALSE(feature(0.5) == feature(0.9));
}

TEST(CurveTest, ManyPointsCostLittle) {
  const std::vector<double> spline = SplineNumbers(WavyLoop(10000, true));
  const Curve curve(SplineView(spline));
  class Counter : public Curve::Visitor {
   public:
    void Visit(const Curve::Minimum&) override { ++count; }
    int count = 0;
  } visited;
  internal::SplineFoot foot;
  foot.point = Vector2<double>(0.8, 0.1);
  curve.ForEachMinimum(foot, 0.5, &visited);
  EXPECT_GE(visited.count, 1);
  EXPECT_LE(visited.count, 5);
}

}  // namespace
}  // namespace tangible
