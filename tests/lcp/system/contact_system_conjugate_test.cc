// SPDX-License-Identifier: Apache-2.0
//
// Bodies held beside masses so far greater that a round of refinement gains nothing.
#include <gtest/gtest.h>

#include "../../support/contact_problems.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

using testing::DenseSystem;

// A body on the floor, at two corners, and one hinged to it off its centre, above.
ContactProblem<double> HingedOnAHeldOne(double held, double above) {
  ContactProblem<double> p = testing::FreeBodies({0.0, -0.1, 0.0, 0.0, -0.1, 0.0});
  for (int i = 0; i < 6; ++i) {
    p.mass[i] *= i < 3 ? held : above;
    p.load[i] *= i < 3 ? held : above;
  }
  JointBlock<double> hinge;
  hinge.a = 1;
  hinge.b = 0;
  hinge.rows = 2;
  hinge.row_a[0] = {1.0, 0.0, 0.0};
  hinge.row_a[1] = {0.0, 1.0, 0.0};
  hinge.row_b[0] = {-1.0, 0.0, 0.25};
  hinge.row_b[1] = {0.0, -1.0, -0.05};
  p.joints.push_back(hinge);
  p.contacts.push_back(testing::FloorContact(0, -0.2, -0.2, 0.5));
  p.contacts.push_back(testing::FloorContact(0, 0.2, -0.2, 0.5));
  return p;
}

class ContactSystemConjugateTest : public ::testing::TestWithParam<std::pair<double, double>> {};

TEST_P(ContactSystemConjugateTest, WhatIsHeldStaysAndCarriesAll) {
  const auto [held, above] = GetParam();
  const ContactProblem<double> p = HingedOnAHeldOne(held, above);
  const std::vector<ContactMode> modes(2, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  VectorX<double> x = VectorX<double>::Zero(3 * system.num_blocks());
  std::copy(p.load.begin(), p.load.end(), x.data());
  const VectorX<double> rhs = x;
  EXPECT_LT(system.Solve(p, modes, x.data(), 1), 1e-15);
  // δ alone would leave 0.1 m/s of the free 0.1 m/s.
  EXPECT_LT(x.head<6>().cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_NEAR((x[9] + x[12]) / (0.1 * (held + above)), 1.0, 1e-14);
  // As a step takes it.
  VectorX<double> step = rhs;
  EXPECT_LT(system.SolveProximal(p, modes, step.data(), 1), 1e-15);
  EXPECT_LT(step.head<6>().cwiseAbs().maxCoeff(), 1e-15);
}

TEST_P(ContactSystemConjugateTest, TheTransposedSystemIsAsExact) {
  const auto [held, above] = GetParam();
  const ContactProblem<double> p = HingedOnAHeldOne(held, above);
  // One corner sticks, one slides.
  const std::vector<ContactMode> modes = {ContactMode::kSticking, ContactMode::kSlidingPositive};
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  const MatrixX<double> K = DenseSystem(p, modes);
  RowMatrixXd y = RowMatrixXd::Zero(K.rows(), 2);
  y(4, 0) = y(9, 1) = 1.0;  // of the upper body's speed, and of a corner's impulse
  const RowMatrixXd rhs = y;
  EXPECT_LT(system.SolveTransposed(p, modes, y.data(), 2), 1e-15);
  for (int c = 0; c < 2; ++c) {
    const VectorX<double> left = K.transpose() * y.col(c) - rhs.col(c);
    // The terms that cancel in each row.
    const VectorX<double> terms = K.transpose().cwiseAbs() * y.col(c).cwiseAbs();
    EXPECT_LT(left.cwiseAbs().maxCoeff() / terms.maxCoeff(), 1e-14) << c;
  }
}

INSTANTIATE_TEST_SUITE_P(Masses, ContactSystemConjugateTest,
                         ::testing::Values(std::make_pair(1.0, 1e12), std::make_pair(1e-12, 1.0),
                                           std::make_pair(1e-3, 1e6)));

// Redundant rows that contradict each other have no solution: what is left of the contradiction is
// told, and the rest solved.
TEST(ContactSystemConjugateTest, AContradictionIsReported) {
  ContactProblem<double> p = HingedOnAHeldOne(1.0, 1e12);
  p.contacts.push_back(p.contacts[0]);
  const std::vector<ContactMode> modes(3, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  VectorX<double> x = VectorX<double>::Zero(3 * system.num_blocks());
  std::copy(p.load.begin(), p.load.end(), x.data());
  x[9] =
      1e-3;  // the corner is asked to open at 1 mm/s by one of its two rows, to stay by the other
  const double left = system.Solve(p, modes, x.data(), 1);
  EXPECT_TRUE(x.allFinite());
  EXPECT_GT(left, 1e-4);
  EXPECT_LT(left, 2e-2);
  EXPECT_LT(x.head<6>().cwiseAbs().maxCoeff(), 1e-2);
}

}  // namespace
}  // namespace tangible
