// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/spline_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace tangible {
namespace {

SplinePiece<double> PieceAt(const std::vector<double>& points, const std::vector<double>& m,
                            size_t i) {
  return MakePiece(points[2 * i], points[2 * i + 1], points[2 * i + 2], points[2 * i + 3],
                   &m[2 * i]);
}

// Three points have the parabola through them; four one cubic, which has no jump of the third
// derivative anywhere.
TEST(SplineCurveTest, FewPointsAreOneCubic) {
  const std::vector<double> three = {-1.0, 1.0, 0.0, 0.0, 1.0, 1.0};
  const std::vector<double> m = SplineCurvatures(three);
  for (const double share : {0.2, 0.7}) {
    const Vector2<double> at = PieceAt(three, m, 1).At(share * std::sqrt(2.0)).place;
    EXPECT_NEAR(at.x(), share, 1e-15);
    EXPECT_NEAR(at.y(), share * share, 1e-15);
  }
  const std::vector<double> four = {0.0, 0.0, 1.0, 0.5, 2.0, -0.5, 2.5, 1.0};
  const std::vector<double> of_four = SplineCurvatures(four);
  for (int i = 0; i < 2; ++i) {
    const double first = PieceAt(four, of_four, 0).jerk[i];
    EXPECT_NEAR(PieceAt(four, of_four, 1).jerk[i], first, 1e-13);
    EXPECT_NEAR(PieceAt(four, of_four, 2).jerk[i], first, 1e-13);
  }
}

// Places, directions and second derivatives of both pieces at a point are the same, at the closing
// point too.
TEST(SplineCurveTest, IsTwiceContinuous) {
  for (const bool closed : {false, true}) {
    std::vector<double> points = {0.0, 0.0, 1.0, -0.2, 1.5, 0.8, 0.9, 1.4, -0.3, 0.9};
    if (closed) points.insert(points.end(), {0.0, 0.0});
    const std::vector<double> m = SplineCurvatures(points);
    const size_t count = points.size() / 2 - 1;
    for (size_t i = 0; i < count; ++i) {
      if (!closed && i + 1 == count) continue;
      const SplinePiece<double> before = PieceAt(points, m, i);
      const SplineAt<double> end = before.At(before.length);
      const SplineAt<double> start = PieceAt(points, m, (i + 1) % count).At(0.0);
      EXPECT_NEAR((end.place - start.place).norm(), 0.0, 1e-14);
      EXPECT_NEAR((end.rate - start.rate).norm(), 0.0, 1e-13);
      EXPECT_NEAR((end.bend - start.bend).norm(), 0.0, 1e-13);
    }
  }
}

// The radius of a closed curve through points of a circle is wrong by O(n⁻⁴).
TEST(SplineCurveTest, ACircleIsOfFourthOrder) {
  const auto error = [](int n) {
    std::vector<double> points;
    for (int i = 0; i <= n; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i % n) / n;
      points.insert(points.end(), {std::cos(angle), std::sin(angle)});
    }
    const std::vector<double> m = SplineCurvatures(points);
    double most = 0.0;
    for (int i = 0; i < n; ++i) {
      const SplinePiece<double> piece = PieceAt(points, m, static_cast<size_t>(i));
      most = std::max(most, std::abs(piece.At(0.5 * piece.length).place.norm() - 1.0));
    }
    return most;
  };
  EXPECT_LT(error(20), 1e-4);
  EXPECT_NEAR(error(20) / error(40), 16.0, 0.5);
  EXPECT_NEAR(error(40) / error(80), 16.0, 0.5);
}

// A Jet's derivative is that of differences.
TEST(SplineCurveTest, DerivativesByPoints) {
  const std::vector<double> points = {0.0, 0.0, 1.0, -0.2, 1.5, 0.8, 0.9, 1.4, 0.0, 0.0};
  std::vector<LocalJet> jets(points.begin(), points.end());
  jets[2].v[0] = 1.0;
  jets[0].v[1] = jets[8].v[1] = 1.0;  // the closing point, twice
  const std::vector<LocalJet> m = SplineCurvatures(jets);
  for (int k = 0; k < 2; ++k) {
    const auto moved = [&](double step) {
      std::vector<double> at = points;
      if (k == 0) {
        at[2] += step;
      } else {
        at[0] += step;
        at[8] += step;
      }
      return SplineCurvatures(at);
    };
    const std::vector<double> more = moved(1e-5), less = moved(-1e-5);
    for (size_t i = 0; i < m.size(); ++i) {
      EXPECT_NEAR(m[i].v[k], (more[i] - less[i]) / 2e-5, 1e-8 * (1.0 + std::abs(m[i].v[k])));
    }
  }
}

}  // namespace
}  // namespace tangible
