// SPDX-License-Identifier: Apache-2.0
//
// What a mode system leaves at a point, beside its dense matrix.
#include <gtest/gtest.h>

#include "../../support/contact_problems.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

using testing::DenseSystem;
using testing::RandomModes;
using testing::RightHandSide;

TEST(ContactSystemResidualTest, IsThatOfTheDenseMatrix) {
  std::mt19937_64 random(6);
  ContactProblem<double> p = testing::RandomContactProblem(&random, 5, 6);
  std::vector<ContactMode> modes = RandomModes(p, &random);
  // One that sticks and one that slides, driven.
  p.contacts[1].driven = p.contacts[2].driven = true;
  modes[1] = ContactMode::kSticking;
  modes[2] = ContactMode::kSlidingNegative;
  const MatrixX<double> K = DenseSystem(p, modes);
  ContactSystem system;
  system.Factor(p, modes);
  RowMatrixXd x = RightHandSide(K);
  const RowMatrixXd rhs = RightHandSide(K);
  RowMatrixXd residual(K.rows(), 2);
  system.Residual<false>(p, modes, rhs.data(), x.data(), 2, residual.data());
  EXPECT_LT((residual - (rhs - K * x)).norm(), 1e-13);
  system.Residual<true>(p, modes, rhs.data(), x.data(), 2, residual.data());
  EXPECT_LT((residual - (rhs - K.transpose() * x)).norm(), 1e-13);
}

// The largest entry relative to the magnitude of its kind of row: momenta, or speeds.
TEST(ContactSystemResidualTest, IsJudgedByTheTermsOfItsKindOfRow) {
  ContactProblem<double> p = testing::FreeBodies({0.0, -1.0, 0.0});
  for (int i = 0; i < 3; ++i) {
    p.mass[i] *= 1e6;
    p.load[i] *= 1e6;
  }
  p.contacts.push_back(testing::FloorContact(0, 0.0, 0.0, 0.5));
  const std::vector<ContactMode> modes = {ContactMode::kSticking};
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  const double rhs[] = {0.0, -1e6, 0.0, 0.0, 0.0, 0.0};
  double residual[6];
  const double solved[] = {0.0, 0.0, 0.0, 1e6, 0.0, 0.0};
  EXPECT_EQ(system.Residual<false>(p, modes, rhs, solved, 1, residual), 0.0);
  const double weak[] = {0.0, 0.0, 0.0, 0.999e6, 0.0, 0.0};  // 1e3 N s are missing of 1e6
  EXPECT_NEAR(system.Residual<false>(p, modes, rhs, weak, 1, residual), 1e-3, 1e-15);
  EXPECT_NEAR(residual[1], -1e3, 1e-9);
}

}  // namespace
}  // namespace tangible
