// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/derivative.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "../../support/random_problem.h"
#include "../../support/step_cases.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

LcpVector Unit(const MixedLcp<double>& problem, Eigen::Index i) {
  LcpVector unit{VectorX<double>::Zero(problem.num_v()), VectorX<double>::Zero(problem.num_y()),
                 VectorX<double>::Zero(problem.num_z())};
  unit.v[i] = 1.0;
  return unit;
}

LcpDerivative Differentiate(const MixedLcp<double>& problem, SolverChoice solver) {
  const LcpSolution<double> solution = SolveLcp(problem, {.solver = solver});
  EXPECT_EQ(solution.status, LcpStatus::kSolved);
  return {problem, {solution.v, solution.y, solution.z}};
}

// d v / d parameter by the adjoint: the gradient of each vᵢ contracted with the data's change.
VectorX<double> ByAdjoint(const LcpDerivative& derivative, const MixedLcp<double>& problem,
                          const MixedLcp<double>& change) {
  VectorX<double> column(problem.num_v());
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    column[i] = Contract(derivative.Adjoint(Unit(problem, i)), change);
  }
  return column;
}

class StepCaseTest : public ::testing::TestWithParam<SolverChoice> {};

TEST_P(StepCaseTest, ValuesAndTwoSidedDerivatives) {
  int derivatives = 0;
  for (const StepCase& step : StepCases()) {
    SCOPED_TRACE(step.id());
    const MixedLcp<double>& problem = step.problem();
    const LcpSolution<double> solution = SolveLcp(problem, {.solver = GetParam()});
    ASSERT_EQ(solution.status, LcpStatus::kSolved);
    const VectorX<double> v = ToVector(step.data()["v_plus"]);
    EXPECT_LT((solution.v - v).cwiseAbs().maxCoeff(), 1e-12);
    const LcpDerivative derivative(problem, {solution.v, solution.y, solution.z});
    for (const auto& [parameter, exact] : step.data()["gradient"].items()) {
      SCOPED_TRACE(parameter);
      const VectorX<double> expected = ToVector(exact);
      const MixedLcp<double> change = step.Perturbation(parameter);
      const double tolerance = 1e-9 * std::max(1.0, expected.cwiseAbs().maxCoeff());
      EXPECT_LT((derivative.Tangent(change).v - expected).cwiseAbs().maxCoeff(), tolerance);
      EXPECT_LT((ByAdjoint(derivative, problem, change) - expected).cwiseAbs().maxCoeff(),
                tolerance);
      derivatives += expected.isZero(0.0) ? 0 : 1;
    }
  }
  EXPECT_GT(derivatives, 100);
}

TEST_P(StepCaseTest, KinksAreFiniteAndBetweenTheirSides) {
  for (const StepCase& step : StepCases()) {
    SCOPED_TRACE(step.id());
    const LcpDerivative derivative = Differentiate(step.problem(), GetParam());
    const bool single = derivative.certificate().degenerate_rows == 1;
    for (const auto& [parameter, sides] : step.data()["one_sided"].items()) {
      SCOPED_TRACE(parameter);
      const MixedLcp<double> change = step.Perturbation(parameter);
      const VectorX<double> tangent = derivative.Tangent(change).v;
      EXPECT_TRUE(tangent.allFinite());
      EXPECT_LT((tangent - ByAdjoint(derivative, step.problem(), change)).norm(), 1e-12);
      if (!single) continue;
      const VectorX<double> plus = ToVector(sides["plus"]);
      const VectorX<double> minus = ToVector(sides["minus"]);
      // The central path's element of a single degenerate row is the mean.
      EXPECT_LT((tangent - 0.5 * (plus + minus)).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
}

TEST_P(StepCaseTest, OneSidedTangentsAreExact) {
  for (const StepCase& step : StepCases()) {
    const LcpDerivative derivative = Differentiate(step.problem(), GetParam());
    // Redundant rows under an inconsistent perturbation are no kink of rows that are degenerate.
    if (derivative.certificate().degenerate_rows == 0) continue;
    for (const auto& [parameter, sides] : step.data()["one_sided"].items()) {
      SCOPED_TRACE(step.id() + " " + parameter);
      const MixedLcp<double> change = step.Perturbation(parameter);
      LcpVector plus;
      LcpVector minus;
      ASSERT_TRUE(derivative.OneSidedTangent(change, plus));
      MixedLcp<double> zero = Moved(change, change, -1.0);
      ASSERT_TRUE(derivative.OneSidedTangent(Moved(zero, change, -1.0), minus));
      EXPECT_LT((plus.v - ToVector(sides["plus"])).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((-minus.v - ToVector(sides["minus"])).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
}

TEST_P(StepCaseTest, CertificateDistinguishesKinksFromRedundancy) {
  for (const StepCase& step : StepCases()) {
    SCOPED_TRACE(step.id());
    const LcpDerivative derivative = Differentiate(step.problem(), GetParam());
    const Certificate certificate = derivative.certificate();
    if (step.id() == "deg_grazing_frictionless") {
      EXPECT_EQ(certificate.verdict, "near a kink: kink of 1 rows at row 0");
    } else if (step.id() == "deg_newton_cradle_rest") {
      EXPECT_EQ(certificate.degenerate_rows, 2);
    } else if (step.id().rfind("near_", 0) == 0) {
      EXPECT_EQ(certificate.degenerate_rows, 0);
      EXPECT_LT(certificate.margin_min, 1e-8);
      EXPECT_GT(certificate.margin_min, 0.0);
    } else {
      EXPECT_EQ(certificate.verdict, "trustworthy");
      EXPECT_GT(certificate.margin_min, 1e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, StepCaseTest,
                         ::testing::Values(SolverChoice::kAuto, SolverChoice::kInteriorPoint,
                                           SolverChoice::kLemke));

// All seven blocks against central differences of the solver, by tangent and by adjoint.
TEST(DerivativeTest, EveryDatumAgainstDifferences) {
  RandomProblem random(1);
  for (int k = 0; k < 30; ++k) {
    const MixedLcp<double> problem = random.Make(4, 2, 6);
    const LcpDerivative derivative(problem, random.solution);
    const MixedLcp<double> change = random.Perturbation(problem);
    const double h = 1e-6;
    const LcpSolution<double> plus = SolveLcp(Moved(problem, change, h));
    const LcpSolution<double> minus = SolveLcp(Moved(problem, change, -h));
    // The same modes on both sides.
    for (Eigen::Index i = 0; i < 6; ++i) {
      ASSERT_EQ(plus.z[i] > 0.0, i % 2 == 0);
      ASSERT_EQ(minus.z[i] > 0.0, i % 2 == 0);
    }
    const LcpVector tangent = derivative.Tangent(change);
    const LcpVector loss{random.Matrix(4, 1), random.Matrix(2, 1), random.Matrix(6, 1)};
    const auto contract = [&loss](const auto& x) {
      return loss.v.dot(x.v) + loss.y.dot(x.y) + loss.z.dot(x.z);
    };
    const double by_tangent = contract(tangent);
    const double by_adjoint = Contract(derivative.Adjoint(loss), change);
    const double by_difference = (contract(plus) - contract(minus)) / (2.0 * h);
    EXPECT_GT(std::abs(by_tangent), 1e-3);
    const double size = 1.0 + tangent.v.norm() + tangent.y.norm() + tangent.z.norm();
    EXPECT_NEAR(by_adjoint, by_tangent, 1e-12 * size);
    // h² of the third derivative and rounding / h.
    EXPECT_NEAR(by_difference, by_tangent, 1e-8 * size * size * size);
    EXPECT_NE(by_difference, by_tangent);
  }
}

TEST(DerivativeTest, GradientOfMIsSymmetric) {
  RandomProblem random(2);
  const MixedLcp<double> problem = random.Make(4, 1, 4);
  const LcpDerivative derivative(problem, random.solution);
  const MixedLcp<double> gradient = derivative.Adjoint(Unit(problem, 2));
  EXPECT_TRUE(gradient.M == gradient.M.transpose());
  EXPECT_GT(gradient.M.norm(), 1e-3);
}

TEST(DerivativeTest, DuplicatedRowsChangeNothing) {
  RandomProblem random(3);
  const MixedLcp<double> problem = random.Make(5, 2, 6);
  const MixedLcp<double> change = random.Perturbation(problem);
  const auto doubled = [](const MixedLcp<double>& single, double share) {
    MixedLcp<double> twice = single;
    twice.A.resize(4, 5);
    twice.A << single.A, single.A;
    twice.b.resize(4);
    twice.b << single.b, single.b;
    // Contact 0 twice: its force is shared.
    twice.G.resize(7, 5);
    twice.G << single.G, single.G.row(0);
    twice.c.resize(7);
    twice.c << single.c, single.c[0];
    twice.F.resize(7, 7);
    twice.F << single.F, share * single.F.col(0), single.F.row(0), share * single.F(0, 0);
    return twice;
  };
  const LcpDerivative single(problem, random.solution);
  const MixedLcp<double> twice = doubled(problem, 1.0);
  const LcpSolution<double> solution = SolveLcp(twice);
  ASSERT_EQ(solution.status, LcpStatus::kSolved);
  EXPECT_LT((solution.v - random.solution.v).norm(), 1e-12);
  const LcpDerivative redundant(twice, {solution.v, solution.y, solution.z});
  EXPECT_EQ(redundant.certificate().redundant_rows, 3);
  const VectorX<double> expected = single.Tangent(change).v;
  EXPECT_LT((redundant.Tangent(doubled(change, 1.0)).v - expected).norm(), 1e-10);
  EXPECT_LT((ByAdjoint(redundant, twice, doubled(change, 1.0)) - expected).norm(), 1e-10);
}

TEST(DerivativeTest, ScalarKinkIsTheMeanOfItsSides) {
  MixedLcp<double> problem;
  problem.F = MatrixX<double>{{2.0}};
  problem.c = VectorX<double>{{0.0}};
  ConformEmptyBlocks(problem);
  const LcpDerivative derivative = Differentiate(problem, SolverChoice::kAuto);
  MixedLcp<double> change = problem;
  change.F.setZero();
  change.c[0] = 1.0;
  // z = max(0, −c / 2).
  EXPECT_DOUBLE_EQ(derivative.Tangent(change).z[0], -0.25);
  LcpVector side;
  ASSERT_TRUE(derivative.OneSidedTangent(change, side));
  EXPECT_EQ(side.z[0], 0.0);
  EXPECT_EQ(derivative.certificate().degenerate_rows, 1);
}

// A disc on an incline exactly at the friction limit: rows γ and one of λ± are degenerate, the kink
// is one.
TEST(DerivativeTest, FrictionLimitIsOneKink) {
  const MixedLcp<double> problem = PlainProblem(PlainCase("fr_incline_critical"));
  const LcpDerivative derivative = Differentiate(problem, SolverChoice::kAuto);
  const Certificate certificate = derivative.certificate();
  EXPECT_GE(certificate.degenerate_rows, 1);
  EXPECT_EQ(certificate.margin_min, 0.0);
  MixedLcp<double> change = problem;
  change.F.setZero();
  change.c.setOnes();
  EXPECT_TRUE(derivative.Tangent(change).z.allFinite());
}

TEST(CertificateTest, MergeKeepsTheWorst) {
  Certificate total;
  SetVerdict(total);
  EXPECT_EQ(total.verdict, "trustworthy");
  Merge({.margin_min = 0.1, .margin_where = "step 1", .redundant_rows = 2, .condition = 10.0},
        total);
  Merge({.margin_min = 1e-9, .margin_where = "step 7", .redundant_rows = 1, .condition = 5.0},
        total);
  SetVerdict(total);
  EXPECT_EQ(total.margin_where, "step 7");
  EXPECT_EQ(total.redundant_rows, 3);
  EXPECT_EQ(total.condition, 10.0);
  EXPECT_EQ(total.verdict, "near a kink: margin 1.0e-09 at step 7");
  Merge({.one_sided = "tie of frictions"}, total);
  SetVerdict(total);
  EXPECT_EQ(total.verdict, "near a kink: margin 1.0e-09 at step 7; one-sided: tie of frictions");
  Merge({.discontinuous = "two impacts at once"}, total);
  SetVerdict(total);
  EXPECT_EQ(total.verdict.rfind("discontinuous: two impacts at once; near a kink: ", 0), 0u);
}

}  // namespace
}  // namespace tangible
