// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/plain_case.h"

#include <gtest/gtest.h>

#include "tangible/lcp/dense/solver.h"
#include "tangible/verification/corpus/recomputed.h"

namespace tangible::corpus {
namespace {

TEST(PlainCaseTest, TheDrawnSolutionIsOne) {
  const VectorX<double> none(0);
  for (int index = 0; index < 50; ++index) {
    const PlainCase one = MakeSmallIntegers(3, index);
    const VectorX<double> z =
        Eigen::Map<const VectorX<double>>(one.z.data(), static_cast<Eigen::Index>(one.z.size()));
    EXPECT_EQ(RecomputedResidual(one.problem, none, none, z), 0.0) << one.name;
  }
  EXPECT_EQ(MakeSmallIntegers(3, 7).problem.F, MakeSmallIntegers(3, 7).problem.F);
  EXPECT_NE(MakeSmallIntegers(3, 7).problem.c, MakeSmallIntegers(4, 7).problem.c);
}

// The reason why the portfolio ends with the enumeration of all sets of modes.
TEST(PlainCaseTest, SomeAreSolvedByEnumerationAlone) {
  int enumerated = 0;
  for (int index = 0; index < 200; ++index) {
    const LcpSolution<double> solution = SolveLcp(MakeSmallIntegers(1, index).problem);
    enumerated += solution.solver == LcpSolver::kEnumeration ? 1 : 0;
  }
  EXPECT_GT(enumerated, 0);
}

}  // namespace
}  // namespace tangible::corpus
