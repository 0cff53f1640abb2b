// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_system.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using testing::DenseSystem;
using testing::RandomModes;
using testing::RightHandSide;

TEST(ContactSystemTest, SolvesAsTheDenseMatrixForwardAndTransposed) {
  std::mt19937_64 random(5);
  double largest_difference = 0.0;
  for (int trial = 0; trial < 60; ++trial) {
    ContactProblem<double> p = testing::RandomContactProblem(&random, 4 + trial % 3, 4);
    for (ContactBlock<double>& contact : p.contacts) contact.driven = random() % 3 == 0;
    const std::vector<ContactMode> modes = RandomModes(p, &random);
    const MatrixX<double> K = DenseSystem(p, modes);
    const Eigen::FullPivLU<MatrixX<double>> lu(K);
    if (lu.rcond() < 1e-4) continue;  // random rows may be nearly dependent
    ContactSystem system;
    ASSERT_TRUE(system.Factor(p, modes));
    ASSERT_EQ(3 * system.num_blocks(), K.rows());
    const RowMatrixXd rhs = RightHandSide(K);
    RowMatrixXd x = rhs;
    const double left = system.Solve(p, modes, x.data(), 2);
    EXPECT_LT(left, 1e-13);
    // Rounding times the condition, at most 1e4.
    EXPECT_LT((x - lu.solve(rhs)).norm(), 1e-11 * (1.0 + x.norm()));
    RowMatrixXd y = rhs;
    EXPECT_LT(system.SolveTransposed(p, modes, y.data(), 2), 1e-13);
    EXPECT_LT((K.transpose() * y - rhs).norm(), 1e-11 * (1.0 + y.norm()));
    largest_difference = std::max(largest_difference, (x - y).norm());
  }
  EXPECT_GT(largest_difference, 0.1);
}

TEST(ContactSystemTest, DuplicatedContactsOfABoxLeaveTheTwistRight) {
  // Four times the same corner pair: rows are redundant, the twist is not.
  ContactProblem<double> p = testing::FreeBodies({0.3, -1.0, 0.2});
  for (int k = 0; k < 4; ++k) {
    p.contacts.push_back(testing::FloorContact(0, k % 2 == 0 ? -0.5 : 0.5, -0.5, 0.8));
  }
  const std::vector<ContactMode> modes(4, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  VectorX<double> x = VectorX<double>::Zero(15);
  for (int i = 0; i < 3; ++i) x[i] = p.load[i];
  system.Solve(p, modes, x.data(), 1);
  EXPECT_LT(x.head<3>().norm(), 1e-12);
  EXPECT_NEAR(x[3] + x[6] + x[9] + x[12], 1.0, 1e-12);  // the normal impulses carry the momentum
}

// The same contact twice, in the first column asked to open at two speeds: the second column, a
// push that both carry, is refined all the same.
TEST(ContactSystemTest, AColumnThatContradictsRowsLeavesTheOthersExact) {
  ContactProblem<double> p = testing::FreeBodies({0.3, -1.0, 0.2});
  for (int k = 0; k < 2; ++k) p.contacts.push_back(testing::FloorContact(0, 0.0, -0.5, 0.8));
  const std::vector<ContactMode> modes(2, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  RowMatrixXd x = RowMatrixXd::Zero(9, 2);
  x(3, 0) = 1.0;
  x(1, 1) = -1.0;
  system.Solve(p, modes, x.data(), 2);
  EXPECT_LT(std::abs(x(1, 1)), 1e-14);  // it stays at rest; δ alone would leave 5e-11
  EXPECT_NEAR(x(3, 1) + x(6, 1), 1.0, 1e-13);
}

// A push that a light body passes on takes a second correction: none is kept from it by a column
// that none can help.
TEST(ContactSystemTest, AColumnIsRefinedAsLongAsItselfGetsBetter) {
  ContactProblem<double> p = testing::FreeBodies({0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  for (int i = 3; i < 6; ++i) p.mass[i] *= 9e3;
  JointBlock<double> joint;
  joint.a = 1;
  joint.b = 0;
  joint.rows = 3;
  for (int i = 0; i < 3; ++i) {
    joint.row_a[i] = joint.row_b[i] = {0.0, 0.0, 0.0};
    joint.row_a[i][i] = 1.0;
    joint.row_b[i][i] = -1.0;
  }
  p.joints.push_back(joint);
  for (int k = 0; k < 2; ++k) p.contacts.push_back(testing::FloorContact(0, 0.0, -0.5, 0.8));
  const std::vector<ContactMode> modes(2, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  RowMatrixXd x = RowMatrixXd::Zero(3 * system.num_blocks(), 2);
  x(9, 0) = 1.0;
  x(4, 1) = -9e3;
  system.Solve(p, modes, x.data(), 2);
  EXPECT_LT(std::abs(x(4, 1)), 1e-15);  // one correction leaves 5e-13
  EXPECT_NEAR((x(9, 1) + x(12, 1)) / 9e3, 1.0, 1e-15);
}

TEST(ContactSystemTest, RowMobilityOfAnOffCentreRow) {
  const ContactProblem<double> p = testing::FreeBodies({0, 0, 0, 0, 0, 0});
  const RowPart<double> row = {0.0, 1.0, 0.5};
  EXPECT_DOUBLE_EQ(RowMobility(p.mass, 0, row, -1, row), 1.0 + 0.25 / 0.1);
  EXPECT_DOUBLE_EQ(RowMobility(p.mass, 0, row, 1, row), 2.0 * (1.0 + 0.25 / 0.1));
}

}  // namespace
}  // namespace tangible
