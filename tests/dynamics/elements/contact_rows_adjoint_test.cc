// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contact_rows_adjoint.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

// A contact of two shapes and its rows as a function of poses and numbers.
struct Contact {
  ContactFeature feature;
  ShapeType type_a, type_b;
  std::vector<double> numbers_a, numbers_b;
  double pose_a[3], pose_b[3];

  ShapeView<double> A() const {
    return {type_a, numbers_a.data(), static_cast<int>(numbers_a.size())};
  }
  ShapeView<double> B() const {
    return {type_b, numbers_b.data(), static_cast<int>(numbers_b.size())};
  }
  static Pose<double> PoseOf(const double* q) { return {Vector2<double>(q[0], q[1]), q[2]}; }
  ContactRows<double> Rows() const {
    ContactRows<double> rows;
    rows.geometry = EvaluateContact(feature, A(), PoseOf(pose_a), B(), PoseOf(pose_b));
    RowsFromGeometry(type_a, PoseOf(pose_a).position, type_b, PoseOf(pose_b).position, &rows);
    return rows;
  }
};

// A different weight on each row's entries and on the gap.
constexpr RowsAdjoint kWeights = {
    {0.7, -0.3, 1.1}, {0.2, 0.9, -0.6}, {-0.8, 0.4, 0.5}, {1.3, -0.1, 0.35}, -0.9};

double Weighed(const Contact& contact) {
  const ContactRows<double> rows = contact.Rows();
  double sum = kWeights.gap * rows.geometry.gap;
  for (int i = 0; i < 3; ++i) {
    sum += kWeights.normal_a[i] * rows.normal_a[i] + kWeights.normal_b[i] * rows.normal_b[i] +
           kWeights.tangent_a[i] * rows.tangent_a[i] + kWeights.tangent_b[i] * rows.tangent_b[i];
  }
  return sum;
}

// A crate's corner above a turned crate, discs side by side, a disc over a slope.
std::vector<Contact> Contacts() {
  std::vector<Contact> contacts = {{{},
                                    ShapeType::kBox,
                                    ShapeType::kBox,
                                    {1.0, 0.6},
                                    {2.0, 1.0},
                                    {0.3, 1.1, 0.5},
                                    {0.0, 0.1, 0.1}},
                                   {{},
                                    ShapeType::kCircle,
                                    ShapeType::kCircle,
                                    {0.3},
                                    {0.4},
                                    {0.5, 0.2, 0.7},
                                    {-0.1, -0.2, 0.3}},
                                   {{},
                                    ShapeType::kHalfPlane,
                                    ShapeType::kCircle,
                                    {0.3, 1.0, 0.1},
                                    {0.2},
                                    {0.1, -0.2, 0.1},
                                    {0.5, 0.4, 0.2}}};
  for (Contact& contact : contacts) {
    ContactFeature features[2];
    EXPECT_GE(FindContactFeatures(contact.A(), Contact::PoseOf(contact.pose_a), contact.B(),
                                  Contact::PoseOf(contact.pose_b), 10.0, features),
              1);
    contact.feature = features[0];
  }
  return contacts;
}

TEST(ContactRowsAdjointTest, IsTheDifferenceQuotientInPosesAndRadii) {
  for (Contact contact : Contacts()) {
    ContactSideAdjoint a, b;
    ContactRowsAdjoint(contact.feature, contact.A(), Contact::PoseOf(contact.pose_a), contact.B(),
                       Contact::PoseOf(contact.pose_b), contact.Rows(), kWeights, &a, &b);
    const auto difference = [&](double* x) {
      constexpr double kStep = 1e-6;
      const double at = *x;
      *x = at + kStep;
      const double above = Weighed(contact);
      *x = at - kStep;
      const double below = Weighed(contact);
      *x = at;
      return (above - below) / (2.0 * kStep);
    };
    double size = 0.0;
    for (int i = 0; i < 3; ++i) {
      // Rounding 1e-16 / 1e-6 and the cube of the step.
      EXPECT_NEAR(a.pose[i], difference(&contact.pose_a[i]), 1e-9) << i;
      EXPECT_NEAR(b.pose[i], difference(&contact.pose_b[i]), 1e-9) << i;
      size += std::abs(a.pose[i]) + std::abs(b.pose[i]);
    }
    EXPECT_GT(size, 1.0);
    if (contact.type_b == ShapeType::kCircle) {
      EXPECT_NEAR(b.numbers[0], difference(contact.numbers_b.data()), 1e-9);
      EXPECT_GT(std::abs(b.numbers[0]), 0.1);
    }
  }
}

TEST(ContactRowsAdjointTest, AddsToWhatIsThere) {
  const Contact contact = Contacts()[0];
  const auto pull_back = [&](ContactSideAdjoint a, ContactSideAdjoint b) {
    ContactRowsAdjoint(contact.feature, contact.A(), Contact::PoseOf(contact.pose_a), contact.B(),
                       Contact::PoseOf(contact.pose_b), contact.Rows(), kWeights, &a, &b);
    return a.pose[2] + b.pose[1];
  };
  ContactSideAdjoint given;
  given.pose[1] = 2.0;
  given.pose[2] = 3.0;
  EXPECT_NEAR(pull_back(given, given), 5.0 + pull_back({}, {}), 1e-14);
}

}  // namespace
}  // namespace tangible
