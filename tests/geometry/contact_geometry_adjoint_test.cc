// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/contact_geometry_adjoint.h"

#include <gtest/gtest.h>

#include "random_shapes.h"

namespace tangible::testing {
namespace {

// A different weight on gap, normal and point.
ContactGeometry<double> Weights() {
  ContactGeometry<double> bar;
  bar.gap = -0.9;
  bar.normal = Vector2<double>(0.7, -0.3);
  bar.point = Vector2<double>(0.4, 1.1);
  return bar;
}

double Weighed(const ContactGeometry<double>& geometry) {
  const ContactGeometry<double> bar = Weights();
  return bar.gap * geometry.gap + bar.normal.dot(geometry.normal) + bar.point.dot(geometry.point);
}

// By the poses of random shapes that are apart, beside difference quotients.
TEST(ContactGeometryAdjointTest, IsTheDifferenceQuotientInPoses) {
  std::mt19937 random(20240611);
  int compared = 0;
  for (int sample = 0; sample < 300; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    double q[6];
    for (int i = 0; i < 6; ++i) {
      q[i] = Uniform(&random, i < 3 ? -1.0 : 3.0, i < 3 ? 1.0 : 6.0);
    }
    const auto pose_a = [&] { return At(q[0], q[1], q[2]); };
    const auto pose_b = [&] { return At(q[3], q[4], q[5]); };
    const Contacts contacts = Collide(a, pose_a(), b, pose_b());
    if (contacts.count == 0 || contacts.geometry[0].gap < 0.1) continue;
    ContactSideAdjoint a_bar, b_bar;
    EvaluateContactAdjoint(contacts.features[0], a.View(), pose_a(), b.View(), pose_b(), Weights(),
                           &a_bar, &b_bar);
    for (int i = 0; i < 6; ++i) {
      constexpr double kStep = 1e-6;
      const double at = q[i];
      double values[2];
      for (const int side : {0, 1}) {
        q[i] = at + (side == 1 ? kStep : -kStep);
        values[side] =
            Weighed(EvaluateContact(contacts.features[0], a.View(), pose_a(), b.View(), pose_b()));
      }
      q[i] = at;
      // The square of the step times third derivatives of up to 1 / gap³, and rounding.
      EXPECT_NEAR(i < 3 ? a_bar.pose[i] : b_bar.pose[i - 3],
                  (values[1] - values[0]) / (2.0 * kStep), 1e-7)
          << sample << " " << i;
    }
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

}  // namespace
}  // namespace tangible::testing
