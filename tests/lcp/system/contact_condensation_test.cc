// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_condensation.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../../support/contact_problems.h"
#include "../../support/random_matrix.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

TEST(ContactCondensationTest, FewContactsAndLargeFrictionAreNotCondensed) {
  ContactProblem<double> p = testing::FreeBodies({0, 0, 0, 0, 0, 0});
  for (int i = 0; i < 4; ++i)
    p.contacts.push_back(testing::FloorContact(i % 2, 0.1 * i, -0.5, 0.5));
  std::vector<ContactMode> modes(4, ContactMode::kSticking);
  EXPECT_TRUE(WorthCondensing(p, modes));
  modes[3] = ContactMode::kSlidingPositive;
  EXPECT_TRUE(WorthCondensing(p, modes));
  p.contacts[3].friction = 100.0;
  EXPECT_FALSE(WorthCondensing(p, modes));
  modes[3] = ContactMode::kSticking;  // λt is an unknown of its own
  EXPECT_TRUE(WorthCondensing(p, modes));
  modes[0] = modes[1] = ContactMode::kOpen;
  EXPECT_FALSE(WorthCondensing(p, modes));
}

TEST(ContactCondensationTest, OpenContactsArePartOfThePattern) {
  ContactProblem<double> p = testing::FreeBodies({0, 0, 0, 0, 0, 0});
  p.contacts.push_back(testing::FloorContact(0, 0.1, -0.5, 0.5));
  p.contacts.push_back(testing::FloorContact(1, 0.1, -0.5, 0.5));
  p.contacts[1].b = 0;
  std::vector<std::pair<int, int>> edges;
  AddContactEdges(p, &edges);
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0], std::make_pair(1, 0));
}

// By hand: K [v; λ] = r with dense elimination of λ, for both directions.
TEST(ContactCondensationTest, RightHandSideAndImpulsesAreThoseOfElimination) {
  std::mt19937_64 random(11);
  for (int trial = 0; trial < 30; ++trial) {
    ContactProblem<double> p = testing::RandomContactProblem(&random, 4, 5);
    p.joints.clear();
    std::vector<ContactMode> modes;
    for (ContactBlock<double>& c : p.contacts) {
      c.driven = random() % 4 == 0;
      modes.push_back(!c.has_friction     ? ContactMode::kClosed
                      : random() % 2 == 0 ? ContactMode::kSticking
                                          : ContactMode::kSlidingNegative);
    }
    std::vector<int> block(p.contacts.size());
    for (size_t i = 0; i < block.size(); ++i) block[i] = p.num_bodies + static_cast<int>(i);
    const int size = 3 * (p.num_bodies + static_cast<int>(block.size()));
    // Large δ, so that all is well conditioned.
    std::vector<double> delta(size, 0.0);
    MatrixX<double> K = testing::DenseSystem(p, modes);
    ASSERT_EQ(K.rows(), size);
    for (size_t i = 0; i < block.size(); ++i) {
      const int rows = modes[i] == ContactMode::kSticking ? 2 : 1;
      for (int k = 0; k < rows; ++k) {
        const int at = 3 * block[i] + k;
        delta[at] = 0.5 + 0.1 * k;
        if (!(k == 0 && p.contacts[i].driven)) K(at, at) += delta[at];
      }
    }
    VectorX<double> rhs = testing::RandomMatrix(size, 1, 1);
    for (size_t i = 0; i < block.size(); ++i) {
      for (int k = modes[i] == ContactMode::kSticking ? 2 : 1; k < 3; ++k)
        rhs[3 * block[i] + k] = 0;
    }
    const ClosedContacts contacts = {p, modes, block, delta};
    const int n = 3 * p.num_bodies;
    for (const bool transposed : {false, true}) {
      const MatrixX<double> matrix = transposed ? MatrixX<double>(K.transpose()) : K;
      const VectorX<double> expected = matrix.partialPivLu().solve(rhs);
      VectorX<double> x = rhs;
      transposed ? CondenseRightHandSide<true>(contacts, x.data(), 1)
                 : CondenseRightHandSide<false>(contacts, x.data(), 1);
      const int m = size - n;
      const MatrixX<double> schur =
          matrix.topLeftCorner(n, n) -
          matrix.topRightCorner(n, m) * MatrixX<double>(matrix.bottomRightCorner(m, m))
                                            .partialPivLu()
                                            .solve(MatrixX<double>(matrix.bottomLeftCorner(m, n)));
      x.head(n) = schur.partialPivLu().solve(VectorX<double>(x.head(n)));
      transposed ? RecoverImpulses<true>(contacts, x.data(), 1)
                 : RecoverImpulses<false>(contacts, x.data(), 1);
      EXPECT_LT((x - expected).norm(), 1e-10 * (1.0 + expected.norm())) << trial << transposed;
    }
  }
}

// A heavy body on a light one, each with two contacts that stick.
ContactProblem<double> HeavyOnLight(double ratio) {
  ContactProblem<double> p = testing::FreeBodies({0.1, -1.0, 0.2, 0.0, -1.0, 0.0});
  for (int i = 3; i < 6; ++i) {
    p.mass[i] *= ratio;
    p.load[i] *= ratio;
  }
  for (const double x : {-0.5, 0.5}) {
    p.contacts.push_back(testing::FloorContact(0, x, -0.5, 0.5));
    ContactBlock<double> on_top = testing::FloorContact(1, x, -0.5, 0.5);
    on_top.b = 0;
    on_top.normal_b = {0.0, -1.0, -x};
    on_top.tangent_b = {-1.0, 0.0, 0.5};
    p.contacts.push_back(on_top);
  }
  return p;
}

VectorX<double> SolvedAtRest(const ContactProblem<double>& p, const std::vector<ContactMode>& modes,
                             ContactSystem* system, double* left) {
  VectorX<double> x = VectorX<double>::Zero(3 * system->num_blocks());
  for (int i = 0; i < 6; ++i) x[i] = p.load[i];
  *left = system->Solve(p, modes, x.data(), 1);
  return x;
}

TEST(ContactCondensationTest, AHeavyBodyOnALightOneIsSolvedCondensed) {
  for (const double ratio : {1e3, 1e6, 1e9, 1e12}) {
    const ContactProblem<double> p = HeavyOnLight(ratio);
    const std::vector<ContactMode> modes(4, ContactMode::kSticking);
    ContactSystem system;
    ASSERT_TRUE(system.Factor(p, modes));
    double left = 0.0;
    const VectorX<double> x = SolvedAtRest(p, modes, &system, &left);
    EXPECT_EQ(system.expansions(), 0) << ratio;
    EXPECT_LT(left, 1e-14) << ratio;
    EXPECT_LT(x.head<6>().norm(), 1e-12) << ratio;  // both rest
    // The floor carries both.
    EXPECT_NEAR(x[6] + x[12], p.load[1] * -1.0 - p.load[4], 1e-9 * ratio) << ratio;
  }
}

// A corner that one of two equal rows lets open and the other holds: what no refinement lessens may
// be the condensed system's loss, and the whole one is asked.
TEST(ContactCondensationTest, WhatDoesNotRefineIsFactorisedAsAWhole) {
  ContactProblem<double> p = HeavyOnLight(1.0);
  p.contacts.push_back(p.contacts[0]);
  const std::vector<ContactMode> modes(5, ContactMode::kSticking);
  ContactSystem system;
  ASSERT_TRUE(system.Factor(p, modes));
  const VectorX<double> momenta =
      Eigen::Map<const VectorX<double>>(p.load.data(), static_cast<Eigen::Index>(6));
  VectorX<double> x = VectorX<double>::Zero(3 * system.num_blocks());
  x.head<6>() = momenta;
  EXPECT_LT(system.Solve(p, modes, x.data(), 1), 1e-14);
  EXPECT_EQ(system.expansions(), 0);
  x.setZero();
  x.head<6>() = momenta;
  x[3 * system.contact_block()[0]] = 0.1;
  EXPECT_GT(system.Solve(p, modes, x.data(), 1), 0.01);  // of the free speeds, 1 m/s
  EXPECT_EQ(system.expansions(), 1);
  EXPECT_TRUE(x.allFinite());
}

}  // namespace
}  // namespace tangible
