// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/torque_free.h"

#include <gtest/gtest.h>

#include "../../support/contact_problems.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

// Three bodies: the first on the floor, the second on a bar from the first, the third free.
ContactProblem<double> Problem() {
  ContactProblem<double> problem =
      testing::FreeBodies({0.3, -1.0, 0.7, 0.2, -0.5, -0.4, 0.1, 0.1, 0.1});
  problem.contacts = {testing::FloorContact(0, 0.0, -0.2, 0.0)};
  JointBlock<double> bar;
  bar.a = 0;
  bar.b = 1;
  bar.rows = 1;
  bar.row_a[0] = {0.6, 0.8, 0.0};
  bar.row_b[0] = {-0.6, -0.8, 0.0};
  problem.joints = {bar};
  return problem;
}

TEST(TorqueFreeTest, BodiesAreTurnedByRowsWithTheirAngle) {
  using enum Turning;
  ContactProblem<double> problem = Problem();
  std::vector<Turning> turning;
  FindTurning(problem, &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kNone, kNone, kUntouched}));
  EXPECT_EQ(CountAnglesLeftOut(turning), 2);

  problem.contacts[0].has_friction = true;  // its tangent has an arm
  FindTurning(problem, &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kTurned, kNone, kUntouched}));

  problem = Problem();
  problem.joints[0].row_b[0][2] = 1e-300;
  FindTurning(problem, &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kNone, kTurned, kUntouched}));
  problem.joints[0].rows = 0;
  FindTurning(problem, &turning);
  EXPECT_EQ(CountAnglesLeftOut(turning), 1);

  problem = Problem();
  problem.dampers.push_back({1, 2, {1.0, 0.0, 0.0}, {-1.0, 0.0, 0.5}, 0.1});
  FindTurning(problem, &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kNone, kNone, kTurned}));
  // Of two problems, what either does.
  AddTurning(Problem(), &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kNone, kNone, kTurned}));
  FindTurning(Problem(), &turning);
  AddTurning(problem, &turning);
  EXPECT_EQ(turning, (std::vector<Turning>{kNone, kNone, kTurned}));
}

TEST(TorqueFreeTest, AnglesLeftOutKeepTheirSpeedAndTheOthersAreSolved) {
  ContactProblem<double> problem = Problem();
  const std::vector<ContactMode> modes = {ContactMode::kClosed};
  const auto solve = [&](const ContactProblem<double>& p) {
    ContactSystem system;
    EXPECT_TRUE(system.Factor(p, modes));
    std::vector<double> x(3 * system.num_blocks(), 0.0);
    std::copy(p.load.begin(), p.load.end(), x.begin());
    system.Solve(p, modes, x.data(), 1);
    return x;
  };
  const std::vector<double> x = solve(problem);
  EXPECT_DOUBLE_EQ(x[2], 0.7);
  EXPECT_DOUBLE_EQ(x[5], -0.4);
  EXPECT_NEAR(x[1], 0.0, 1e-15);
  EXPECT_NEAR(0.6 * (x[0] - x[3]) + 0.8 * (x[1] - x[4]), 0.0, 1e-15);
  // With arms of nothing every angle is an unknown, of the same solution.
  problem.contacts[0].normal_a[2] = 1e-200;
  problem.joints[0].row_b[0][2] = 1e-200;
  const std::vector<double> full = solve(problem);
  for (size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], full[i], 1e-15) << i;
}

}  // namespace
}  // namespace tangible
