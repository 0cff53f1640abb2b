// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/row_rates.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

MovingPose<double> Moving(double x, double y, double angle, double vx, double vy, double omega) {
  MovingPose<double> m{Pose<double>(Vector2<double>(x, y), angle), {vx, vy, omega}};
  return m;
}

Pose<double> After(const MovingPose<double>& m, double time) {
  return Pose<double>(m.pose.position + time * Vector2<double>(m.twist[0], m.twist[1]),
                      m.pose.angle + time * m.twist[2]);
}

double Speed(const RowPart<double>& a, const MovingPose<double>& of_a, const RowPart<double>& b,
             const MovingPose<double>& of_b) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    sum += a[i] * of_a.twist[i] + b[i] * of_b.twist[i];
  }
  return sum;
}

constexpr double kTime = 1e-5;

TEST(JointRatesTest, AreTheChangeOfTheRowsSpeedsAtConstantTwists) {
  const MovingPose<double> a = Moving(0.3, 0.2, 0.5, 0.7, -0.4, 1.3);
  const MovingPose<double> b = Moving(-0.2, 0.1, -0.3, 0.2, 0.5, -0.8);
  const double numbers[7] = {0.4, -0.1, -0.3, 0.2, 0.8, 0.6, 0.1};
  const struct {
    JointType type;
    int count;
  } kinds[] = {{JointType::kRevolute, 5}, {JointType::kPrismatic, 7},  {JointType::kWeld, 5},
               {JointType::kDistance, 5}, {JointType::kFixedAngle, 1}, {JointType::kRope, 5}};
  for (const auto& kind : kinds) {
    JointRows<double> rows;
    JointRates<double> rates;
    EvaluateJointRates(kind.type, a, b, numbers, kind.count, &rows, &rates);
    JointRows<double> plus, minus, here;
    EvaluateJoint(kind.type, After(a, kTime), After(b, kTime), numbers, &plus);
    EvaluateJoint(kind.type, After(a, -kTime), After(b, -kTime), numbers, &minus);
    EvaluateJoint(kind.type, After(a, 0.0), After(b, 0.0), numbers, &here);
    ASSERT_EQ(rows.rows, here.rows);
    for (int k = 0; k < rows.rows; ++k) {
      EXPECT_EQ(rows.row_a[k], here.row_a[k]);
      EXPECT_EQ(rows.error[k], here.error[k]);
      EXPECT_NEAR(rates.row[k],
                  (Speed(plus.row_a[k], a, plus.row_b[k], b) -
                   Speed(minus.row_a[k], a, minus.row_b[k], b)) /
                      (2.0 * kTime),
                  1e-8)
          << "type " << static_cast<int>(kind.type) << " row " << k;
    }
    if (kind.type == JointType::kPrismatic) {
      EXPECT_NEAR(rates.coordinate,
                  (Speed(plus.coordinate_a, a, plus.coordinate_b, b) -
                   Speed(minus.coordinate_a, a, minus.coordinate_b, b)) /
                      (2.0 * kTime),
                  1e-8);
    }
  }
}

TEST(ContactRatesTest, AreTheChangeOfNormalAndSlidingSpeedAtConstantTwists) {
  const double polygon[6] = {-0.4, -0.2, 0.5, -0.3, 0.1, 0.6};
  const double circle[1] = {0.2};
  const double box[2] = {0.6, 0.3};
  const double plane[3] = {0.3, 1.1, 0.05};
  const ShapeView<double> shapes[] = {{ShapeType::kPolygon, polygon, 6},
                                      {ShapeType::kCircle, circle, 1},
                                      {ShapeType::kBox, box, 2},
                                      {ShapeType::kHalfPlane, plane, 3}};
  const MovingPose<double> a = Moving(0.3, 0.9, 0.5, 0.7, -0.4, 1.3);
  const MovingPose<double> b = Moving(-0.2, 0.1, -0.3, 0.2, 0.5, -0.8);
  int pairs = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      ContactFeature features[2];
      const int count =
          FindContactFeatures(shapes[i], After(a, 0.0), shapes[j], After(b, 0.0), 10.0, features);
      for (int k = 0; k < count; ++k, ++pairs) {
        ContactRateScratch<double> scratch;
        ContactRows<double> rows, plus, minus;
        ContactRates<double> rates;
        EvaluateContactRates(features[k], shapes[i], a, shapes[j], b, &scratch, &rows, &rates);
        const auto at = [&](double time, ContactRows<double>* out) {
          out->geometry =
              EvaluateContact(features[k], shapes[i], After(a, time), shapes[j], After(b, time));
          RowsFromGeometry(shapes[i].type, After(a, time).position, shapes[j].type,
                           After(b, time).position, out);
        };
        at(kTime, &plus);
        at(-kTime, &minus);
        const auto change = [&](double later, double earlier) {
          return (later - earlier) / (2.0 * kTime);
        };
        EXPECT_NEAR(rates.normal,
                    change(Speed(plus.normal_a, a, plus.normal_b, b),
                           Speed(minus.normal_a, a, minus.normal_b, b)),
                    1e-7);
        EXPECT_NEAR(rates.tangent,
                    change(Speed(plus.tangent_a, a, plus.tangent_b, b),
                           Speed(minus.tangent_a, a, minus.tangent_b, b)),
                    1e-7);
        // The normal row is the gap's gradient: its speed is the gap's rate.
        EXPECT_NEAR(Speed(rows.normal_a, a, rows.normal_b, b),
                    change(plus.geometry.gap, minus.geometry.gap), 1e-8);
      }
    }
  }
  EXPECT_GE(pairs, 12);
}

}  // namespace
}  // namespace tangible
