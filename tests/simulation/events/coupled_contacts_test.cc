// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/coupled_contacts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

constexpr RowPart<double> kNone = {0.0, 0.0, 0.0};

// A body of 2 kg and 0.5 kg m² for each of `bodies`.
ContactProblem<double> Free(int bodies) {
  ContactProblem<double> problem;
  problem.num_bodies = bodies;
  for (int i = 0; i < bodies; ++i) {
    problem.mass.insert(problem.mass.end(), {2.0, 2.0, 0.5});
  }
  problem.load.assign(problem.mass.size(), 0.0);
  return problem;
}

// A contact of body a with a fixed one, with the normal n at the arm r, without friction.
ContactBlock<double> Fixed(int a, const RowPart<double>& n, const RowPart<double>& t = kNone) {
  ContactBlock<double> contact{};
  contact.a = a;
  contact.b = -1;
  contact.normal_a = n;
  contact.tangent_a = t;
  contact.has_friction = t != kNone;
  contact.friction = contact.has_friction ? 0.5 : 0.0;
  return contact;
}

ContactBlock<double> Between(int a, int b, const RowPart<double>& n) {
  ContactBlock<double> contact = Fixed(a, n);
  contact.b = b;
  contact.normal_b = {-n[0], -n[1], -n[2]};
  return contact;
}

std::vector<int> Groups(const ContactProblem<double>& problem) {
  return GroupsOfContacts(problem, std::vector<bool>(problem.contacts.size(), true));
}

TEST(CoupledContactsTest, NormalsAtRightAnglesDoNotActOnEachOther) {
  ContactProblem<double> problem = Free(1);
  // Also in axes that are turned, where rounding is left of the product.
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  problem.contacts = {Fixed(0, {c, s, 0.0}), Fixed(0, {-s, c, 0.0})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 1}));
  problem.contacts = {Fixed(0, {c, s, 0.0}), Fixed(0, {-s + 1e-9, c, 0.0})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 0}));
}

TEST(CoupledContactsTest, FrictionAndArmsAct) {
  ContactProblem<double> problem = Free(1);
  problem.contacts = {Fixed(0, {1.0, 0.0, 0.0}), Fixed(0, {0.0, 1.0, 0.0}, {-1.0, 0.0, 0.1})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 0}));
  // Two faces of a box, each touched beside its middle; one of them in its middle.
  problem.contacts = {Fixed(0, {1.0, 0.0, 0.2}), Fixed(0, {0.0, 1.0, -0.1})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 0}));
  problem.contacts = {Fixed(0, {1.0, 0.0, 0.0}), Fixed(0, {0.0, 1.0, -0.1})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 1}));
  // Parallel forces at the centre of percussion: 1 / m = r r' / I.
  problem.contacts = {Fixed(0, {1.0, 0.0, 0.5}), Fixed(0, {1.0, 0.0, -0.5})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 1}));
}

TEST(CoupledContactsTest, AThirdContactAndAJointConnect) {
  ContactProblem<double> problem = Free(2);
  problem.contacts = {Fixed(0, {1.0, 0.0, 0.0}), Fixed(1, {1.0, 0.0, 0.0}),
                      Fixed(0, {0.0, 1.0, 0.0})};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 1, 2}));
  problem.contacts.push_back(Between(0, 1, {0.6, 0.8, 0.0}));
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 0, 0, 0}));
  problem.contacts.back() = Between(0, 1, {0.0, 1.0, 0.0});
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 1, 2, 2}));
  // Contacts that are not wanted may be in other groups.
  EXPECT_EQ(GroupsOfContacts(problem, {false, false, true, true}), (std::vector<int>{0, 0, 0, 0}));
  // A bar along x passes on what acts along x, and nothing else.
  problem.contacts.pop_back();
  JointBlock<double> joint{};
  joint.a = 0;
  joint.b = 1;
  joint.rows = 1;
  joint.row_a[0] = {1.0, 0.0, 0.0};
  joint.row_b[0] = {-1.0, 0.0, 0.0};
  problem.joints = {joint};
  EXPECT_EQ(Groups(problem), (std::vector<int>{0, 0, 1}));
}

}  // namespace
}  // namespace tangible
