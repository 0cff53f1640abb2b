// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_conditioning.h"

#include <gtest/gtest.h>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using testing::FloorContact;

/// A body on two corners, each listed `copies` times.
ContactProblem<double> Box(int copies) {
  ContactProblem<double> problem = testing::FreeBodies({0.0, -1.0, 0.0});
  for (int i = 0; i < copies; ++i) {
    problem.contacts.push_back(FloorContact(0, -0.5, -0.5, 0.3));
    problem.contacts.push_back(FloorContact(0, 0.5, -0.5, 0.3));
  }
  return problem;
}

SystemQuality Measure(const ContactProblem<double>& problem, ContactMode mode) {
  const std::vector<ContactMode> modes(problem.contacts.size(), mode);
  ContactSystem system;
  EXPECT_TRUE(system.Factor(problem, modes));
  return MeasureSystem(problem, modes, &system);
}

TEST(ContactConditioningTest, RedundantRowsAreThoseBeyondTheRank) {
  const auto count = [](int copies, ContactMode mode) {
    const ContactProblem<double> problem = Box(copies);
    return CountRedundantRows(problem, std::vector<ContactMode>(2 * copies, mode));
  };
  EXPECT_EQ(count(1, ContactMode::kClosed), 0);
  EXPECT_EQ(count(1, ContactMode::kSlidingPositive), 0);
  // Two normals and one tangent are independent; the tangents are the same row.
  EXPECT_EQ(count(1, ContactMode::kSticking), 1);
  EXPECT_EQ(count(2, ContactMode::kClosed), 2);
  EXPECT_EQ(count(2, ContactMode::kSticking), 5);
  EXPECT_EQ(count(2, ContactMode::kOpen), 0);
}

TEST(ContactConditioningTest, FeetOfDifferentFrictionLeaveTheMotionOpenWhereOneWouldDo) {
  ContactProblem<double> problem = Box(1);
  const std::vector<ContactMode> slide(2, ContactMode::kSlidingPositive);
  const auto count = [&] { return CountUndeterminedMotions(problem, slide); };
  problem.contacts[1].friction = 0.5;
  EXPECT_EQ(count(), 0);  // what tips it tells the normal impulses
  for (ContactBlock<double>& contact : problem.contacts) {
    contact.normal_a[2] = 0.0;  // as for a body that cannot turn
    contact.tangent_a[2] = 0.0;
  }
  EXPECT_EQ(count(), 1);
  EXPECT_EQ(CountUndeterminedMotions(problem, {ContactMode::kSticking, ContactMode::kSticking}), 0);
  problem.contacts[1].friction = problem.contacts[0].friction;
  EXPECT_EQ(CountRedundantRows(problem, slide), 1);
  EXPECT_EQ(count(), 0);
}

TEST(ContactConditioningTest, ConditionOfOneContactIsThatByHandWhateverTheMass) {
  for (const double mass : {1.0, 1e-6, 1e6}) {
    ContactProblem<double> problem = testing::FreeBodies({0.0, -1.0, 0.0});
    problem.mass = {mass, mass, 0.1 * mass};
    EXPECT_NEAR(Measure(problem, ContactMode::kOpen).condition, 1.0, 1e-14);
    problem.contacts = {FloorContact(0, 0.0, -0.5, 0.0)};
    const SystemQuality quality = Measure(problem, ContactMode::kClosed);
    // ‖[1 −1; 1 0]‖₁ = 2, and its inverse's [0 1; −1 1] 2. Scales are rounded and K regularised.
    EXPECT_NEAR(quality.condition, 4.0, 1e-6);
    EXPECT_LT(quality.residual, 1e-13);
  }
}

TEST(ContactConditioningTest, ADrivenContactHasOnlyItsTangentRow) {
  ContactProblem<double> problem = Box(1);
  for (ContactBlock<double>& contact : problem.contacts) contact.driven = true;
  const auto count = [&](ContactMode mode) { return CountRedundantRows(problem, {mode, mode}); };
  EXPECT_EQ(count(ContactMode::kClosed), 0);
  EXPECT_EQ(count(ContactMode::kSticking), 1);
  // Two equal normal rows are redundant, two impulses that are given are not.
  problem.contacts[1] = problem.contacts[0];
  EXPECT_EQ(count(ContactMode::kClosed), 0);
  EXPECT_NEAR(Measure(problem, ContactMode::kClosed).condition, 1.0, 1e-14);
}

TEST(ContactConditioningTest, NearlyParallelRowsAreIllConditionedNotRedundant) {
  ContactProblem<double> problem = testing::FreeBodies({0.0, -1.0, 0.0});
  problem.contacts = {FloorContact(0, -1e-4, 0.0, 0.0), FloorContact(0, 1e-4, 0.0, 0.0)};
  EXPECT_EQ(CountRedundantRows(problem, {ContactMode::kClosed, ContactMode::kClosed}), 0);
  // The angle between the scaled rows is 2e-4 / sqrt(0.1); its square divides.
  EXPECT_GT(Measure(problem, ContactMode::kClosed).condition, 1e6);
}

}  // namespace
}  // namespace tangible
