// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_conditioning.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

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

// The rank deficiency of all active rows at once, and by how much more directions impulses act in.
struct DenseCounts {
  int impulses, motions;
};
DenseCounts CountDensely(const ContactProblem<double>& problem,
                         const std::vector<ContactMode>& modes) {
  Eigen::MatrixXd rows(0, 3 * problem.num_bodies), pushes(0, 3 * problem.num_bodies);
  const auto add = [&](const ContactBlock<double>& c, double normal, double tangent, bool of_rows) {
    Eigen::MatrixXd& to = of_rows ? rows : pushes;
    to.conservativeResize(to.rows() + 1, Eigen::NoChange);
    auto row = to.row(to.rows() - 1);
    row.setZero();
    for (int i = 0; i < 3; ++i) {
      if (c.a >= 0) row[3 * c.a + i] = normal * c.normal_a[i] + tangent * c.tangent_a[i];
      if (c.b >= 0) row[3 * c.b + i] = normal * c.normal_b[i] + tangent * c.tangent_b[i];
    }
    for (int i = 0; i < row.size(); ++i) {
      row[i] /= std::sqrt(problem.mass[i]);
    }
  };
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      ContactBlock<double> as_contact;
      as_contact.a = joint.a;
      as_contact.b = joint.b;
      as_contact.normal_a = joint.row_a[k];
      as_contact.normal_b = joint.row_b[k];
      as_contact.tangent_a = as_contact.tangent_b = {0.0, 0.0, 0.0};
      add(as_contact, 1.0, 0.0, true);
      add(as_contact, 1.0, 0.0, false);
    }
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = problem.contacts[i];
    if (modes[i] == ContactMode::kOpen) continue;
    add(c, 1.0, 0.0, true);
    add(c, 1.0, -SlidingSign(modes[i]) * c.friction, false);
    if (modes[i] == ContactMode::kSticking) {
      add(c, 0.0, 1.0, true);
      add(c, 0.0, 1.0, false);
    }
  }
  const auto rank = [](const Eigen::MatrixXd& matrix) {
    if (matrix.rows() == 0) return 0;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix.rowwise().normalized().transpose());
    qr.setThreshold(1e-8);
    return static_cast<int>(qr.rank());
  };
  const int of_rows = rank(rows);
  const int impulses = static_cast<int>(rows.rows()) - of_rows;
  return {impulses, impulses > 0 ? std::max(rank(pushes) - of_rows, 0) : 0};
}

/// Bodies at random places that hinges, welds and contacts connect to each other, to themselves
/// twice over and to the ground: trees, loops, piles and bodies that stand alone.
ContactProblem<double> Network(std::mt19937_64* random, int bodies, int hinges, int contacts,
                               std::vector<ContactMode>* modes) {
  ContactProblem<double> p = testing::FreeBodies(std::vector<double>(3 * bodies, 0.0));
  std::vector<std::array<double, 2>> centre;
  for (int i = 0; i < bodies; ++i) {
    centre.push_back({testing::Draw(random, -2, 2), testing::Draw(random, -2, 2)});
    for (int k = 0; k < 3; ++k) p.mass[3 * i + k] *= std::pow(10.0, testing::Draw(random, -2, 2));
  }
  const auto pick = [&](int a) {
    const int b = static_cast<int>((*random)() % (bodies + 1)) - 1;
    return b == a ? -1 : b;
  };
  const auto row = [&](int body, double x, double y, double px, double py) -> RowPart<double> {
    if (body < 0) return {0.0, 0.0, 0.0};
    return {x, y, (px - centre[body][0]) * y - (py - centre[body][1]) * x};
  };
  const auto opposite = [](const RowPart<double>& r) -> RowPart<double> {
    return {-r[0], -r[1], -r[2]};
  };
  for (int k = 0; k < hinges; ++k) {
    JointBlock<double> joint;
    joint.a = static_cast<int>((*random)() % bodies);
    joint.b = pick(joint.a);
    joint.rows = k % 4 == 0 ? 3 : 2;
    const double x = testing::Draw(random, -2, 2), y = testing::Draw(random, -2, 2);
    for (int r = 0; r < joint.rows; ++r) {
      joint.row_a[r] = r == 2 ? RowPart<double>{0.0, 0.0, 1.0} : row(joint.a, 1 - r, r, x, y);
      joint.row_b[r] = opposite(r == 2 ? RowPart<double>{0.0, 0.0, joint.b < 0 ? 0.0 : 1.0}
                                       : row(joint.b, 1 - r, r, x, y));
      joint.rhs[r] = 0.0;
    }
    p.joints.push_back(joint);
    if (k % 5 == 4) p.joints.push_back(joint);  // closed twice
  }
  const ContactMode all[] = {ContactMode::kOpen, ContactMode::kSticking, ContactMode::kClosed,
                             ContactMode::kSlidingPositive, ContactMode::kSlidingNegative};
  for (int k = 0; k < contacts; ++k) {
    ContactBlock<double> c;
    c.a = static_cast<int>((*random)() % bodies);
    c.b = pick(c.a);
    const double angle = static_cast<double>((*random)() % 4) * 0.5 * M_PI;
    const double x = testing::Draw(random, -2, 2), y = testing::Draw(random, -2, 2);
    c.normal_a = row(c.a, std::cos(angle), std::sin(angle), x, y);
    c.normal_b = opposite(row(c.b, std::cos(angle), std::sin(angle), x, y));
    c.tangent_a = row(c.a, std::sin(angle), -std::cos(angle), x, y);
    c.tangent_b = opposite(row(c.b, std::sin(angle), -std::cos(angle), x, y));
    c.c_n = c.c_t = 0.0;
    c.friction = testing::Draw(random, 0.1, 0.9);
    c.has_friction = true;
    for (int copies = 1 + k % 2; copies > 0; --copies) {
      p.contacts.push_back(c);
      modes->push_back(all[(*random)() % 5]);
      c.friction += 0.3;
    }
  }
  return p;
}

TEST(ContactConditioningTest, RanksByGroupsAreThoseOfAllRowsAtOnce) {
  std::mt19937_64 random(16);
  int redundant = 0, undetermined = 0, smaller = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int bodies = 1 + trial % 12;
    std::vector<ContactMode> modes;
    const ContactProblem<double> problem =
        Network(&random, bodies, trial / 12 % 7, trial / 5 % 9, &modes);
    const DenseCounts dense = CountDensely(problem, modes);
    EXPECT_EQ(CountRedundantRows(problem, modes), dense.impulses) << trial;
    const UndeterminedCounts counts = CountUndetermined(problem, modes, HUGE_VAL);
    EXPECT_TRUE(counts.counted);
    EXPECT_EQ(counts.impulses, dense.impulses) << trial;
    EXPECT_EQ(counts.motions, dense.motions) << trial;
    redundant += dense.impulses > 0 ? 1 : 0;
    undetermined += dense.motions > 0 ? 1 : 0;
    smaller += counts.largest.bodies < bodies ? 1 : 0;
  }
  EXPECT_GT(redundant, 100);
  EXPECT_GT(undetermined, 10);
  EXPECT_GT(smaller, 100);
}

// Of 60 000 unknowns and 80 000 rows one matrix would take 38 GB.
TEST(ContactConditioningTest, BodiesThatOnlyTheGroundConnectsAreRankedApart) {
  constexpr int kBoxes = 20000;
  ContactProblem<double> problem = testing::FreeBodies(std::vector<double>(3 * kBoxes, 0.0));
  for (int i = 0; i < kBoxes; ++i) {
    problem.contacts.push_back(FloorContact(i, -0.5, -0.5, 0.3));
    problem.contacts.push_back(FloorContact(i, 0.5, -0.5, 0.3));
  }
  const std::vector<ContactMode> modes(2 * kBoxes, ContactMode::kSticking);
  const UndeterminedCounts counts = CountUndetermined(problem, modes, 1e7);
  EXPECT_TRUE(counts.counted);
  EXPECT_EQ(counts.impulses, kBoxes);
  EXPECT_EQ(counts.motions, 0);
  EXPECT_EQ(counts.operations, kBoxes * 2.0 * 4 * 3 * 3);
  EXPECT_EQ(CountRedundantRows(problem, modes), kBoxes);
}

TEST(ContactConditioningTest, AHingedChainIsTakenOffLinkByLinkAndALoopIsNot) {
  constexpr int kLinks = 3000;
  ContactProblem<double> chain = testing::FreeBodies(std::vector<double>(3 * kLinks, 0.0));
  for (int i = 0; i < kLinks; ++i) {
    JointBlock<double> joint;
    joint.a = i;
    joint.b = i - 1;
    joint.rows = 2;
    joint.row_a[0] = {1.0, 0.0, -0.5};
    joint.row_a[1] = {0.0, 1.0, 0.1};
    joint.row_b[0] = {-1.0, 0.0, -0.5};
    joint.row_b[1] = {0.0, -1.0, 0.1};
    chain.joints.push_back(joint);
  }
  UndeterminedCounts counts = CountUndetermined(chain, {}, 0.0);
  EXPECT_TRUE(counts.counted);
  EXPECT_EQ(counts.impulses, 0);
  JointBlock<double> last = chain.joints[0];
  last.a = kLinks - 1;
  chain.joints.push_back(last);
  counts = CountUndetermined(chain, {}, 1e10);
  EXPECT_FALSE(counts.counted);
  EXPECT_EQ(counts.largest.bodies, kLinks);
  EXPECT_EQ(counts.largest.rows, 2 * kLinks + 2);
  EXPECT_GT(counts.operations, 1e10);
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
