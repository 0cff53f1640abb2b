// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Mixed LCPs small enough to be solved by hand.

#include <initializer_list>

#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"

namespace tangible::testing {

inline VectorX<double> ListOf(std::initializer_list<double> numbers) {
  VectorX<double> vector(static_cast<Eigen::Index>(numbers.size()));
  Eigen::Index i = 0;
  for (const double x : numbers) vector[i++] = x;
  return vector;
}

/// s = F z + c.
inline MixedLcp<double> PlainLcp(std::initializer_list<std::initializer_list<double>> F,
                                 std::initializer_list<double> c) {
  MixedLcp<double> problem;
  problem.c = ListOf(c);
  problem.F.resize(problem.c.size(), problem.c.size());
  Eigen::Index i = 0;
  for (const auto& row : F) problem.F.row(i++) = ListOf(row).transpose();
  ConformEmptyBlocks(problem);
  return problem;
}

/// A mass of 1 with one speed v and momentum p, above `contacts` equal contacts: v ⊥ each z.
inline MixedLcp<double> OneBodyOnContacts(int contacts, double p) {
  MixedLcp<double> problem;
  problem.M = MatrixX<double>::Ones(1, 1);
  problem.p = ListOf({p});
  problem.G = MatrixX<double>::Ones(contacts, 1);
  problem.F = MatrixX<double>::Zero(contacts, contacts);
  problem.c = VectorX<double>::Zero(contacts);
  ConformEmptyBlocks(problem);
  return problem;
}

/// Without joints.
inline LcpVector PointOf(std::initializer_list<double> v, std::initializer_list<double> z) {
  return {ListOf(v), VectorX<double>(0), ListOf(z)};
}

}  // namespace tangible::testing
