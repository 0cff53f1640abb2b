// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/cubic_spline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

using Series = std::vector<double>;

const Series kUnevenKnots = {-1.0, -0.7, 0.1, 0.2, 0.9, 2.0};
const Series kValues = {0.0, 0.4, -0.3, 0.0, 1.1, 0.0};

double Cubic(double t) { return 2.0 - 3.0 * t + 0.5 * t * t + 0.25 * t * t * t; }

Series Sample(const Series& knots, double (*function)(double)) {
  Series values;
  for (const double knot : knots) values.push_back(function(knot));
  return values;
}

TEST(CubicSplineTest, CubicsAreReproducedOnUnevenKnots) {
  for (std::size_t size = 4; size <= kUnevenKnots.size(); ++size) {
    const Series knots(kUnevenKnots.begin(), kUnevenKnots.begin() + static_cast<long>(size));
    const CubicSpline<double> spline(knots, Sample(knots, Cubic));
    for (double t = knots.front() + 0.01; t < knots.back(); t += 0.05) {
      const SplinePoint<double> at = spline.At(t, t);
      EXPECT_NEAR(at.value, Cubic(t), 1e-14 * 16) << size << " " << t;
      EXPECT_NEAR(at.rate, -3.0 + t + 0.75 * t * t, 1e-14 * 100) << size << " " << t;
      EXPECT_NEAR(at.acceleration, 1.0 + 1.5 * t, 1e-14 * 1000) << size << " " << t;
    }
  }
}

TEST(CubicSplineTest, FewPoints) {
  // A parabola, a line and a constant.
  const CubicSpline<double> three({0.0, 1.0, 3.0}, {1.0, 2.0, 10.0});
  SplinePoint<double> at = three.At(2.0, 2.0);
  EXPECT_NEAR(at.value, 5.0, 1e-14);
  EXPECT_NEAR(at.rate, 4.0, 1e-14);
  EXPECT_NEAR(at.acceleration, 2.0, 1e-14);
  const CubicSpline<double> two({1.0, 3.0}, {1.0, 2.0});
  at = two.At(2.0, 2.0);
  EXPECT_EQ(at.value, 1.5);
  EXPECT_EQ(at.rate, 0.5);
  EXPECT_EQ(at.acceleration, 0.0);
  const CubicSpline<double> one({1.0}, {7.0});
  for (const double t : {0.0, 1.0, 2.0}) {
    EXPECT_EQ(one.At(t, t).value, 7.0);
    EXPECT_EQ(one.At(t, t).rate, 0.0);
  }
}

TEST(CubicSplineTest, TwiceContinuouslyDifferentiableAtKnotsAndHeldOutside) {
  const CubicSpline<double> spline(kUnevenKnots, kValues);
  for (std::size_t i = 1; i + 1 < kUnevenKnots.size(); ++i) {
    const double t = kUnevenKnots[i];
    const SplinePoint<double> left = spline.At(t, t - 1e-3), right = spline.At(t, t + 1e-3);
    EXPECT_NEAR(left.value, kValues[i], 1e-14);
    EXPECT_EQ(right.value, kValues[i]);
    EXPECT_NEAR(left.rate, right.rate, 1e-13);
    EXPECT_NEAR(left.acceleration, right.acceleration, 1e-12);
  }
  for (const bool start : {true, false}) {
    const double t = start ? kUnevenKnots.front() : kUnevenKnots.back();
    const double out = start ? -1e-3 : 1e-3;
    const SplinePoint<double> held = spline.At(t, t + out), moving = spline.At(t, t - out);
    EXPECT_NEAR(held.value, moving.value, 1e-14);
    EXPECT_EQ(held.rate, 0.0);
    EXPECT_EQ(held.acceleration, 0.0);
    EXPECT_GT(std::abs(moving.rate), 0.1);
  }
}

// The third derivative jumps at all inner knots but the first and the last of them.
TEST(CubicSplineTest, NotAKnotAtTheEnds) {
  const CubicSpline<double> spline(kUnevenKnots, kValues);
  const auto jump = [&spline](std::size_t i) {
    const auto jerk = [&spline](double from, double to) {
      const double middle = 0.5 * (from + to);
      return (spline.At(to, middle).acceleration - spline.At(from, middle).acceleration) /
             (to - from);
    };
    return jerk(kUnevenKnots[i], kUnevenKnots[i + 1]) - jerk(kUnevenKnots[i - 1], kUnevenKnots[i]);
  };
  EXPECT_NEAR(jump(1), 0.0, 1e-10);
  EXPECT_NEAR(jump(4), 0.0, 1e-10);
  EXPECT_GT(std::abs(jump(2)), 1.0);
  EXPECT_GT(std::abs(jump(3)), 1.0);
}

TEST(CubicSplineTest, OrdersOfConvergence) {
  double errors[2][3];
  for (int fine = 0; fine < 2; ++fine) {
    const int pieces = fine == 0 ? 40 : 80;
    Series knots;
    for (int i = 0; i <= pieces; ++i) knots.push_back(4.0 * i / pieces);
    const CubicSpline<double> spline(knots, Sample(knots, [](double t) { return std::sin(t); }));
    double* worst = errors[fine];
    worst[0] = worst[1] = worst[2] = 0.0;
    for (double t = 1.0; t < 3.0; t += 0.0017) {
      const SplinePoint<double> at = spline.At(t, t);
      worst[0] = std::max(worst[0], std::abs(at.value - std::sin(t)));
      worst[1] = std::max(worst[1], std::abs(at.rate - std::cos(t)));
      worst[2] = std::max(worst[2], std::abs(at.acceleration + std::sin(t)));
    }
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::log2(errors[0][i] / errors[1][i]), 4.0 - i, 0.1) << i;
  }
}

// Jets of the time, of a value (0 among them, which solvers may skip) and of a knot against central
// differences at two step sizes, and the first against the rate and the acceleration.
TEST(CubicSplineTest, Derivatives) {
  using Jet = ceres::Jet<double, 13>;
  const int size = static_cast<int>(kUnevenKnots.size());
  const auto point = [&](double time, Series knots, Series values, int variable, double change) {
    const double inside = time;
    if (variable == 0) time += change;
    if (variable > 0 && variable <= size) values[static_cast<std::size_t>(variable - 1)] += change;
    if (variable > size) knots[static_cast<std::size_t>(variable - 1 - size)] += change;
    return CubicSpline<double>(knots, values).At(time, inside);
  };
  std::vector<Jet> knots, values;
  for (int i = 0; i < size; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    values.emplace_back(kValues[k], 1 + i);
    knots.emplace_back(kUnevenKnots[k], 1 + size + i);
  }
  const CubicSpline<Jet> spline(knots, values);
  int non_zero = 0;
  for (const double time : {-0.8, -0.2, 0.15, 0.5, 1.5}) {
    const SplinePoint<Jet> at = spline.At(Jet(time, 0), time);
    EXPECT_NEAR(at.value.v[0], at.rate.a, 1e-13);
    EXPECT_NEAR(at.rate.v[0], at.acceleration.a, 1e-12);
    for (int variable = 0; variable < 13; ++variable) {
      const auto central = [&](double step) {
        const SplinePoint<double> up = point(time, kUnevenKnots, kValues, variable, step);
        const SplinePoint<double> down = point(time, kUnevenKnots, kValues, variable, -step);
        return std::array<double, 2>{(up.value - down.value) / (2.0 * step),
                                     (up.rate - down.rate) / (2.0 * step)};
      };
      // Extrapolated: knots are 0.1 apart, so the error is of the order of (step / 0.1)⁴.
      for (const double step : {1e-3, 3e-4}) {
        const auto wide = central(step), narrow = central(0.5 * step);
        EXPECT_NEAR((4.0 * narrow[0] - wide[0]) / 3.0, at.value.v[variable], 1e-7);
        EXPECT_NEAR((4.0 * narrow[1] - wide[1]) / 3.0, at.rate.v[variable], 1e-6);
      }
      non_zero += at.value.v[variable] != 0.0 ? 1 : 0;
    }
  }
  EXPECT_EQ(non_zero, 5 * 13);
}

// The spline is linear in the values: the derivative with respect to one of them is the spline
// through 1 there and 0 at all others.
TEST(CubicSplineTest, DerivativesWithRespectToValuesInClosedForm) {
  using Jet = ceres::Jet<double, 1>;
  for (std::size_t i = 0; i < kValues.size(); ++i) {
    std::vector<Jet> knots(kUnevenKnots.begin(), kUnevenKnots.end());
    std::vector<Jet> values(kValues.begin(), kValues.end());
    values[i].v[0] = 1.0;
    Series unit(kValues.size(), 0.0);
    unit[i] = 1.0;
    const CubicSpline<Jet> spline(knots, values);
    const CubicSpline<double> cardinal(kUnevenKnots, unit);
    for (const double t : {-0.9, 0.0, 0.17, 0.6, 1.9}) {
      const SplinePoint<Jet> at = spline.At(Jet(t), t);
      const SplinePoint<double> expected = cardinal.At(t, t);
      EXPECT_NEAR(at.value.v[0], expected.value, 1e-13);
      EXPECT_NEAR(at.rate.v[0], expected.rate, 1e-12);
      EXPECT_NEAR(at.acceleration.v[0], expected.acceleration, 1e-11);
    }
  }
}

}  // namespace
}  // namespace tangible
