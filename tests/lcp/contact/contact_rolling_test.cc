// SPDX-License-Identifier: Apache-2.0
//
// Problems with rolling friction against all combinations of modes, each by a dense system.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "../../support/contact_problems.h"
#include "tangible/lcp/contact/contact_solver.h"

namespace tangible {
namespace {

using testing::Draw;

constexpr double kHolds = 1e-9;

// Rolling friction ρ of the contact before it.
ContactBlock<double> RollingOf(const ContactBlock<double>& contact, double rolling) {
  ContactBlock<double> block;
  block.a = contact.a;
  block.b = contact.b;
  block.normal_a = block.normal_b = {0.0, 0.0, 0.0};
  block.tangent_a = {0.0, 0.0, 1.0};
  block.tangent_b = {0.0, 0.0, -1.0};
  block.c_n = block.c_t = 0.0;
  block.friction = rolling;
  block.has_friction = rolling > 0.0;
  block.limit_given = block.driven = block.rolls = true;
  return block;
}

// One or two bodies on a floor, and on each other.
ContactProblem<double> RandomProblem(std::mt19937_64* random, double rolling) {
  const int bodies = 1 + static_cast<int>((*random)() % 2);
  std::vector<double> twists;
  for (int i = 0; i < 3 * bodies; ++i) twists.push_back(Draw(random, -1.0, 1.0));
  ContactProblem<double> p = testing::FreeBodies(twists);
  p.has_rolling = true;
  for (int body = 0; body < bodies; ++body) {
    ContactBlock<double> contact = testing::FloorContact(
        body, Draw(random, -0.3, 0.3), Draw(random, -0.5, -0.1), Draw(random, 0.1, 0.5));
    if (body == 1 && random->operator()() % 2 == 0) {
      contact.b = 0;
      contact.normal_b = {-0.0, -1.0, Draw(random, -0.3, 0.3)};
      contact.tangent_b = {-1.0, 0.0, Draw(random, -0.5, -0.1)};
    }
    p.contacts.push_back(contact);
    p.contacts.push_back(RollingOf(contact, rolling * Draw(random, 0.2, 1.0)));
  }
  return p;
}

// Modes of a contact and of its rolling friction: open; or −1, 0, 1 for each, 0 at rest.
struct Modes {
  bool open = true;
  int slides = 0, rolls = 0;
};

// The motion with given modes; empty where it contradicts an inequality.
VectorX<double> MotionWith(const ContactProblem<double>& p, const std::vector<Modes>& modes) {
  const int nv = 3 * p.num_bodies;
  const int contacts = static_cast<int>(modes.size());
  const int size = nv + 3 * contacts;
  MatrixX<double> k = MatrixX<double>::Zero(size, size);
  VectorX<double> rhs = VectorX<double>::Zero(size);
  for (int i = 0; i < nv; ++i) {
    k(i, i) = p.mass[i];
    rhs(i) = p.load[i];
  }
  const auto row_of = [&](const ContactBlock<double>& c, const RowPart<double>& a,
                          const RowPart<double>& b) {
    VectorX<double> row = VectorX<double>::Zero(nv);
    AddRowTransposed(c.a, a, c.b, b, 1.0, row.data());
    return row;
  };
  for (int i = 0; i < contacts; ++i) {
    const ContactBlock<double>& c = p.contacts[2 * i];
    const ContactBlock<double>& r = p.contacts[2 * i + 1];
    const std::array<VectorX<double>, 3> rows = {row_of(c, c.normal_a, c.normal_b),
                                                 row_of(c, c.tangent_a, c.tangent_b),
                                                 row_of(r, r.tangent_a, r.tangent_b)};
    const double constants[3] = {c.c_n, c.c_t, r.c_t};
    const double limits[3] = {0.0, c.friction, r.friction};
    const int slips[3] = {0, modes[i].slides, modes[i].rolls};
    for (int j = 0; j < 3; ++j) {
      const int at = nv + 3 * i + j;
      k.block(0, at, nv, 1) = -rows[j];
      if (modes[i].open) {
        k(at, at) = 1.0;
      } else if (slips[j] != 0) {
        k(at, at) = 1.0;
        k(at, nv + 3 * i) = slips[j] * limits[j];
      } else {
        k.block(at, 0, 1, nv) = rows[j].transpose();
        rhs(at) = -constants[j];
      }
    }
  }
  const VectorX<double> x = k.fullPivLu().solve(rhs);
  if (!((k * x - rhs).cwiseAbs().maxCoeff() <= 1e-10)) return {};
  for (int i = 0; i < contacts; ++i) {
    const ContactBlock<double>& c = p.contacts[2 * i];
    const ContactBlock<double>& r = p.contacts[2 * i + 1];
    const double gap = RowDot(c.a, c.normal_a, c.b, c.normal_b, x.data()) + c.c_n;
    const double slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, x.data()) + c.c_t;
    const double spin = RowDot(r.a, r.tangent_a, r.b, r.tangent_b, x.data()) + r.c_t;
    const double* z = x.data() + nv + 3 * i;
    const bool holds = gap >= -kHolds && z[0] >= -kHolds &&
                       std::abs(z[1]) <= c.friction * z[0] + kHolds &&
                       std::abs(z[2]) <= r.friction * z[0] + kHolds &&
                       (modes[i].slides == 0 || modes[i].slides * slip >= -kHolds) &&
                       (modes[i].rolls == 0 || modes[i].rolls * spin >= -kHolds);
    if (!holds) return {};
  }
  return x.head(nv);
}

void ListModes(size_t contact, std::vector<Modes>* modes,
               const std::function<void(const std::vector<Modes>&)>& visit) {
  if (contact == modes->size()) return visit(*modes);
  (*modes)[contact] = Modes();
  ListModes(contact + 1, modes, visit);
  for (int slides = -1; slides <= 1; ++slides) {
    for (int rolls = -1; rolls <= 1; ++rolls) {
      (*modes)[contact] = {false, slides, rolls};
      ListModes(contact + 1, modes, visit);
    }
  }
}

TEST(ContactRollingTest, RandomProblemsAreSolvedAsByAllModes) {
  std::mt19937_64 random(5);
  int loaded = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const ContactProblem<double> p = RandomProblem(&random, trial % 4 == 0 ? 1.0 : 0.1);
    std::vector<VectorX<double>> motions;
    std::vector<Modes> modes(p.contacts.size() / 2);
    ListModes(0, &modes, [&](const std::vector<Modes>& these) {
      const VectorX<double> motion = MotionWith(p, these);
      if (motion.size() > 0) motions.push_back(motion);
    });
    ContactSolution<double> solution;
    solution.modes.assign(p.contacts.size(), ContactMode::kOpen);
    solution.normal_impulse.assign(p.contacts.size(), 0.0);
    solution.tangent_impulse.assign(p.contacts.size(), 0.0);
    ContactSolver solver;
    const ContactSolverReport report = solver.Solve(p, {}, &solution);
    ASSERT_TRUE(report.solved) << trial;
    const auto found = Eigen::Map<const VectorX<double>>(
        solution.motion.data(), static_cast<Eigen::Index>(solution.motion.size()));
    double nearest = HUGE_VAL;
    for (const VectorX<double>& motion : motions) {
      nearest = std::min(nearest, (motion - found).cwiseAbs().maxCoeff());
    }
    EXPECT_LT(nearest, 1e-9) << trial << " of " << motions.size();
    for (size_t i = 0; i < p.contacts.size(); i += 2) {
      loaded += solution.normal_impulse[i] > 0.0 ? 1 : 0;
      EXPECT_EQ(solution.normal_impulse[i + 1], solution.normal_impulse[i]);
      EXPECT_EQ(solution.modes[i] == ContactMode::kOpen,
                solution.modes[i + 1] == ContactMode::kOpen);
    }
  }
  EXPECT_GT(loaded, 100);
}

// A guess that knows loads but no motion, and has friction where the last solution had none.
TEST(ContactRollingTest, AGuessNeedsNoMotion) {
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 40; ++trial) {
    const ContactProblem<double> p = RandomProblem(&random, 0.1);
    ContactSolution<double> solution, other;
    solution.modes.assign(p.contacts.size(), ContactMode::kOpen);
    solution.normal_impulse.assign(p.contacts.size(), 0.0);
    solution.tangent_impulse.assign(p.contacts.size(), 0.0);
    other = solution;
    other.modes.assign(p.contacts.size(), ContactMode::kClosed);
    other.normal_impulse.assign(p.contacts.size(), 0.1);
    for (size_t i = 0; i < p.contacts.size(); i += 2) other.modes[i] = ContactMode::kSticking;
    ContactSolver solver;
    ASSERT_TRUE(solver.Solve(p, {}, &solution).solved) << trial;
    ASSERT_TRUE(solver.Solve(p, {}, &other).solved) << trial;
    for (size_t i = 0; i < solution.motion.size(); ++i) {
      EXPECT_NEAR(other.motion[i], solution.motion[i], 1e-9) << trial;
    }
  }
}

}  // namespace
}  // namespace tangible
