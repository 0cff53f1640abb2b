// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/corpus_run.h"

#include <gtest/gtest.h>

#include "tangible/lcp/dense/solver.h"
#include "tangible/verification/corpus/recomputed.h"

namespace tangible::corpus {
namespace {

TEST(CorpusRunTest, BoundsHoldOnAFewOfEachKind) {
  const CorpusResult result = RunCorpus({}, {.random = 6, .seed = 1, .most_contacts = 40});
  EXPECT_EQ(FirstFailure(result), "");
  EXPECT_EQ(result.problems, 6 * static_cast<int>(RandomKinds().size()));
  for (const Row& row : result.rows) {
    EXPECT_GT(row.problems, 0) << row.kind;
    if (row.known == Known::kSolvable) {
      EXPECT_GT(row.residual_max, 0.0) << row.kind;
    }
  }
}

TEST(CorpusRunTest, TheSameForAnyNumberOfThreads) {
  RunOptions options{.random = 3, .seed = 4, .most_contacts = 20};
  const CorpusResult one = RunCorpus({}, options);
  options.threads = 3;
  const CorpusResult three = RunCorpus({}, options);
  ASSERT_EQ(one.rows.size(), three.rows.size());
  for (size_t i = 0; i < one.rows.size(); ++i) {
    EXPECT_EQ(one.rows[i].kind, three.rows[i].kind);
    EXPECT_EQ(one.rows[i].residual_max, three.rows[i].residual_max);
    EXPECT_EQ(one.rows[i].solvers, three.rows[i].solvers);
  }
}

// Open contacts left impulses of 1e-48, which counted as violations of their cones; rows that
// rounding makes contradict each other need proximal steps.
TEST(CorpusRunTest, TheGeneralSolverSolvesWhatItOnceLost) {
  for (const auto& [kind, index] : {std::pair{"stack", 163}, {"stack", 46}, {"redundant", 81}}) {
    const CorpusResult result =
        RunCorpus({}, {.random = 1, .seed = 2, .first = index, .only = kind});
    for (const Row& row : result.rows)
      EXPECT_EQ(row.right, 1) << kind << index << ToString(row.way);
  }
}

// What was lost in piles of bodies whose masses are up to 1e9 apart: a light body's momentum was
// measured by a heavy one's (11, 5 and 12: called solved and wrong), modes flickered with one δ
// alone (5 and 13), a long path's rounding and what has no scale but others' rounding (the general
// solver's).
TEST(CorpusRunTest, PilesOfAnyMassesAreSolved) {
  struct {
    const char* kind;
    std::uint64_t seed;
    int index;
  } const cases[] = {{"mass ratio", 11, 8},   {"mass ratio", 5, 102},  {"mass ratio", 12, 172},
                     {"mass ratio", 5, 71},   {"mass ratio", 13, 169}, {"mass ratio", 13, 63},
                     {"mass ratio", 10, 111}, {"stack", 5, 58},        {"stack", 13, 142},
                     {"joints", 13, 63}};
  for (const auto& c : cases) {
    const CorpusResult result =
        RunCorpus({}, {.random = 1, .seed = c.seed, .first = c.index, .only = c.kind});
    for (const Row& row : result.rows) {
      EXPECT_EQ(row.right, 1) << c.kind << " " << c.index << " of seed " << c.seed << ", "
                              << ToString(row.way);
    }
  }
}

// Impulses on a ray of the constraints made the scales so large that slacks far below 0 counted as
// rounding.
TEST(CorpusRunTest, LargeImpulsesDoNotHideViolations) {
  const CorpusResult result = RunCorpus(
      {}, {.random = 1, .seed = 2, .first = 25, .only = "restitution", .most_contacts = 30});
  for (const Row& row : result.rows) EXPECT_EQ(row.wrong, 0) << ToString(row.way);
}

TEST(CorpusRunTest, FilesAreJudgedByWhatIsKnownOfThem) {
  MixedLcp<double> solvable;
  solvable.F = MatrixX<double>::Constant(1, 1, 1.0);
  solvable.c = VectorX<double>::Constant(1, -1.0);
  ConformEmptyBlocks(solvable);
  MixedLcp<double> infeasible = solvable;
  infeasible.F(0, 0) = -1.0;
  const auto failure = [](Known known, const MixedLcp<double>& problem) {
    return FirstFailure(RunCorpus({{"a kind", "a name", known, problem}}, {}));
  };
  EXPECT_EQ(failure(Known::kSolvable, solvable), "");
  EXPECT_EQ(failure(Known::kInfeasible, infeasible), "");
  EXPECT_EQ(failure(Known::kUnknown, infeasible), "");
  // What is said to be known is wrong here: each is a failure that names the problem.
  EXPECT_NE(failure(Known::kSolvable, infeasible).find("a name"), std::string::npos);
  EXPECT_NE(failure(Known::kHardlySolvable, infeasible).find("a name"), std::string::npos);
  EXPECT_NE(failure(Known::kInfeasible, solvable).find("a name"), std::string::npos);
  EXPECT_NE(failure(Known::kUnsolvable, solvable).find("a name"), std::string::npos);
}

TEST(CorpusRunTest, ManyUnsolvedHardOnesAreAFailure) {
  Row row{.kind = "hard", .known = Known::kHardlySolvable};
  row.problems = 100;
  row.right = 95;
  EXPECT_EQ(FirstFailure({{row}, 100}), "");
  row.right = 94;
  EXPECT_NE(FirstFailure({{row}, 100}).find("94 of 100"), std::string::npos);
}

}  // namespace
}  // namespace tangible::corpus
