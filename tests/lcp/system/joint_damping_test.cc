// SPDX-License-Identifier: Apache-2.0
//
// Rods of little inertia on pins: the solution stays exact to rounding, which the closed form of a
// point on a rod shows.
#include "tangible/lcp/system/joint_damping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

constexpr double kMass = 2.0;
constexpr double kLength = 0.5;

// A body whose centre is kLength from a pin, the arm from centre to pin at an angle.
ContactProblem<double> Pendulum(double inertia, double angle) {
  ContactProblem<double> problem;
  problem.num_bodies = 1;
  problem.mass = {kMass, kMass, inertia};
  problem.load = {0.0, 0.0, 0.0};
  JointBlock<double> pin;
  pin.a = 0;
  pin.rows = 2;
  pin.row_a[0] = {1.0, 0.0, -kLength * std::sin(angle)};
  pin.row_a[1] = {0.0, 1.0, kLength * std::cos(angle)};
  pin.row_b[0] = pin.row_b[1] = {0.0, 0.0, 0.0};
  pin.rhs[0] = pin.rhs[1] = 0.0;
  problem.joints = {pin};
  return problem;
}

TEST(JointDampingTest, IsAskedForWhereALeverIsLongForTheInertia) {
  EXPECT_FALSE(HasSpreadJoints(Pendulum(0.1, 0.3)));
  EXPECT_FALSE(HasSpreadJoints(ContactProblem<double>()));
  EXPECT_TRUE(HasSpreadJoints(Pendulum(1e-6, 0.3)));
  const ContactProblem<double> damped = WithJointDampers(Pendulum(1e-6, 0.3));
  ASSERT_EQ(damped.dampers.size(), 2u);
  // The inverse of the mobility by translation.
  EXPECT_NEAR(damped.dampers[0].weight, kMass, 1e-15);
}

// ω = (torque + arm × p) / (I + m r²), for a torque and a momentum at the centre.
TEST(JointDampingTest, SpeedsAndImpulsesAreExactDownToNoInertia) {
  const double angle = 0.83;
  for (const double inertia : {1e-2, 1e-6, 1e-9, 1e-12, 1e-15}) {
    const ContactProblem<double> problem = Pendulum(inertia, angle);
    ContactSystem system;
    ASSERT_TRUE(system.Factor(problem, {}));
    const double px = 0.3;
    const double py = 0.2;
    const double torque = 0.11;
    // Two columns, the second 1e6 times the first: sizes must not matter.
    std::vector<double> x = {px, 1e6 * px, py, 1e6 * py, torque, 1e6 * torque, 0, 0, 0, 0, 0, 0};
    system.Solve(problem, {}, x.data(), 2);
    const double rx = kLength * std::cos(angle);
    const double ry = kLength * std::sin(angle);
    // The centre is at −r from the pin: v = ω (ry, −rx).
    const double omega = (torque + px * ry - py * rx) / (inertia + kMass * kLength * kLength);
    EXPECT_NEAR(x[4], omega, 1e-14) << inertia;
    EXPECT_NEAR(x[5], 1e6 * omega, 1e-8) << inertia;
    EXPECT_NEAR(x[0], omega * ry, 1e-14) << inertia;
    EXPECT_NEAR(x[2], -omega * rx, 1e-14) << inertia;
    // m v − p is the pin's impulse.
    EXPECT_NEAR(x[6], kMass * omega * ry - px, 1e-14) << inertia;
    EXPECT_NEAR(x[8], -kMass * omega * rx - py, 1e-14) << inertia;
  }
}

// yᵀ (K⁻¹ x) = (K⁻ᵀ y)ᵀ x.
TEST(JointDampingTest, TheTransposedSolveIsItsAdjoint) {
  for (const double inertia : {1e-2, 1e-9, 1e-14}) {
    const ContactProblem<double> problem = Pendulum(inertia, -0.4);
    ContactSystem system;
    ASSERT_TRUE(system.Factor(problem, {}));
    const std::vector<double> x = {0.3, -0.2, 0.5, 0.7, 0.1, 0.0};
    const std::vector<double> y = {-0.6, 0.4, 0.9, 0.2, -0.8, 0.0};
    std::vector<double> forward = x;
    std::vector<double> back = y;
    system.Solve(problem, {}, forward.data(), 1);
    system.SolveTransposed(problem, {}, back.data(), 1);
    double a = 0.0;
    double b = 0.0;
    for (int i = 0; i < 6; ++i) {
      a += y[i] * forward[i];
      b += x[i] * back[i];
    }
    EXPECT_NEAR(a, b, 1e-13 * std::max(1.0, std::abs(a))) << inertia;
  }
}

// Two rods, the second with the spread alone: dampers couple both bodies.
TEST(JointDampingTest, ChainsKeepTheirEquations) {
  ContactProblem<double> problem = Pendulum(1e-12, 0.7);
  problem.num_bodies = 2;
  problem.mass.insert(problem.mass.end(), {1.0, 1.0, 1e-13});
  problem.load.assign(6, 0.0);
  JointBlock<double> elbow;
  elbow.a = 1;
  elbow.b = 0;
  elbow.rows = 2;
  elbow.row_a[0] = {1.0, 0.0, 0.2};
  elbow.row_a[1] = {0.0, 1.0, -0.3};
  elbow.row_b[0] = {-1.0, 0.0, -0.1};
  elbow.row_b[1] = {0.0, -1.0, 0.4};
  elbow.rhs[0] = elbow.rhs[1] = 0.0;
  problem.joints.push_back(elbow);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(problem, {}));
  std::vector<double> rhs = {0.3, -0.2, 0.1, 0.4, 0.5, -0.6, 0.05, -0.02, 0.0, 0.01, 0.03, 0.0};
  std::vector<double> x = rhs;
  EXPECT_LT(system.Solve(problem, {}, x.data(), 1), 1e-14);
  std::vector<double> left(rhs.size());
  system.Residual<false>(problem, {}, rhs.data(), x.data(), 1, left.data());
  for (const double value : left) {
    EXPECT_NEAR(value, 0.0, 1e-14);
  }
}

}  // namespace
}  // namespace tangible
