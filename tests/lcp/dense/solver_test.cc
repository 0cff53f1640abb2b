// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/solver.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <set>
#include <string>

#include "../../support/cases.h"
#include "../../support/random_problem.h"
#include "tangible/lcp/dense/active_set.h"
#include "tangible/lcp/dense/farkas.h"

namespace tangible {
namespace {

double Condition(const MatrixX<double>& matrix) {
  const VectorX<double> values = Eigen::JacobiSVD<MatrixX<double>>(matrix).singularValues();
  return values[0] / std::max(values[values.size() - 1], 1e-300);
}

// The condition of the active rows of a plain LCP, which decides how exact z can be.
double ActiveCondition(const MixedLcp<double>& problem, const VectorX<double>& z) {
  std::vector<Eigen::Index> active;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    if (z[i] > 0.0) active.push_back(i);
  }
  return active.empty() ? 1.0 : Condition(problem.F(active, active));
}

void CheckPublishedSolution(const nlohmann::json& data, const MixedLcp<double>& problem,
                            const LcpSolution<double>& solution) {
  EXPECT_LE(solution.residual, 1e-10);
  EXPECT_TRUE((solution.z.array() >= 0.0).all());
  if (data.contains("unique_z")) {
    const VectorX<double> z = ToVector(data["unique_z"]);
    const double tolerance =
        (1e-12 + 100 * 2.2e-16 * ActiveCondition(problem, z)) * std::max(1.0, z.norm());
    EXPECT_LT((solution.z - z).norm(), tolerance);
  }
  if (!data.contains("contacts") || !data["contacts"].contains("v_plus")) return;
  // Its note says that it falls and that it jams: one of them is listed.
  if (data["name"] == "fr_jam_walls_mu1" && solution.solver != LcpSolver::kGuess) return;
  // z = (normal; tangential +; −; γ) impulses of the stated contacts.
  const nlohmann::json& contact = data["contacts"];
  const VectorX<double> v_free = ToVector(contact["v_free"]);
  const Eigen::Index nc = contact["count"];
  const MatrixX<double> Jn = ToMatrix(contact["Jn"], v_free.size());
  const MatrixX<double> Jt = ToMatrix(contact["Jt"], v_free.size());
  const VectorX<double> impulse =
      Jn.transpose() * solution.z.head(nc) +
      Jt.transpose() * (solution.z.segment(nc, nc) - solution.z.segment(2 * nc, nc));
  const VectorX<double> change = ToVector(contact["Minv"]).cwiseProduct(impulse);
  const double size = std::max(1.0, v_free.norm() + change.norm());
  double nearest = std::numeric_limits<double>::infinity();
  for (const nlohmann::json& listed : contact["v_plus"]) {
    nearest = std::min(nearest, (v_free + change - ToVector(listed)).norm());
  }
  EXPECT_LT(nearest, 1e-12 * size);
}

// Every published problem: solved where it can be, and never where it cannot.
void RunCases(const LcpOptions& options, const std::set<std::string>& may_stay_unsolved) {
  int solvable = 0;
  int solved = 0;
  for (const nlohmann::json& data : PlainCases()) {
    const std::string name = data["name"];
    SCOPED_TRACE(name);
    const MixedLcp<double> problem = PlainProblem(data);
    const LcpSolution<double> solution = SolveLcp(problem, options);
    if (data["status"] == "solvable") {
      ++solvable;
      EXPECT_NE(solution.status, LcpStatus::kInfeasible);
      if (solution.status == LcpStatus::kSolved) {
        ++solved;
        CheckPublishedSolution(data, problem, solution);
      } else {
        EXPECT_TRUE(may_stay_unsolved.count(name) > 0);
      }
    } else if (data["status"] == "infeasible") {
      EXPECT_EQ(solution.status, LcpStatus::kInfeasible);
      EXPECT_TRUE(CheckFarkas(problem, solution.farkas));
    } else {
      EXPECT_EQ(solution.status, LcpStatus::kUnsolved);
    }
    EXPECT_TRUE(std::isfinite(solution.residual));
  }
  std::cout << solved << " of " << solvable << " solvable problems solved\n";
  ::testing::Test::RecordProperty("solved", solved);
}

TEST(SolverTest, PublishedProblems) { RunCases({}, {}); }

// cont_ray: Lemke ends on a ray for every covering vector.
TEST(SolverTest, PublishedProblemsByLemke) {
  RunCases({.solver = SolverChoice::kLemke}, {"cont_ray"});
}

TEST(SolverTest, PublishedProblemsByInteriorPoint) {
  RunCases({.solver = SolverChoice::kInteriorPoint}, {});
}

TEST(SolverTest, RandomMixedProblems) {
  RandomProblem random(5);
  for (int k = 0; k < 100; ++k) {
    const MixedLcp<double> problem = random.Make(1 + k % 7, (k % 7) / 3, 1 + k % 9);
    const LcpSolution<double> solution = SolveLcp(problem);
    ASSERT_EQ(solution.status, LcpStatus::kSolved);
    EXPECT_LT(solution.residual, 1e-14);
    EXPECT_LT((solution.z - random.solution.z).norm(), 1e-11);
    EXPECT_LT((solution.v - random.solution.v).norm(), 1e-11);
  }
}

TEST(SolverTest, SizesFromNothingToAFewHundred) {
  EXPECT_EQ(SolveLcp({}).status, LcpStatus::kSolved);
  RandomProblem random(6);
  EXPECT_EQ(SolveLcp(random.Make(4, 2, 0)).status, LcpStatus::kSolved);
  const MixedLcp<double> large = random.Make(40, 5, 120);
  const LcpSolution<double> solution = SolveLcp(large);
  EXPECT_EQ(solution.status, LcpStatus::kSolved);
  EXPECT_LT(solution.residual, 1e-12);
}

TEST(SolverTest, BoxBetweenWallsFalls) {
  for (const char* name : {"fr_jam_walls_mu1", "fr_jam_disc_mu1"}) {
    const nlohmann::json data = PlainCase(name);
    const LcpSolution<double> solution = SolveLcp(PlainProblem(data));
    ASSERT_EQ(solution.status, LcpStatus::kSolved);
    const Eigen::Index contacts = data["contacts"]["count"];
    EXPECT_LT(solution.z.head(3 * contacts).norm(), 1e-15);
  }
}

TEST(SolverTest, RefusesBadData) {
  RandomProblem random(7);
  MixedLcp<double> problem = random.Make(3, 1, 2);
  problem.b[0] = NAN;
  LcpSolution<double> solution = SolveLcp(problem);
  EXPECT_EQ(solution.status, LcpStatus::kUnsolved);
  EXPECT_EQ(solution.message, "b: expected finite numbers");
  problem = random.Make(3, 1, 2);
  problem.F.resize(3, 2);
  problem.F.setZero();
  EXPECT_EQ(SolveLcp(problem).message, "F: expected 2 x 2, got 3 x 2");
}

TEST(SolverTest, RedundantAndContradictoryJoints) {
  RandomProblem random(8);
  MixedLcp<double> problem = random.Make(5, 2, 4);
  const LcpSolution<double> plain = SolveLcp(problem);
  MixedLcp<double> doubled = problem;
  doubled.A.resize(4, 5);
  doubled.A << problem.A, problem.A;
  doubled.b.resize(4);
  doubled.b << problem.b, problem.b;
  const LcpSolution<double> solution = SolveLcp(doubled);
  ASSERT_EQ(solution.status, LcpStatus::kSolved);
  EXPECT_LT((solution.v - plain.v).norm(), 1e-12);
  doubled.b[3] += 0.1;
  const LcpSolution<double> contradictory = SolveLcp(doubled);
  EXPECT_EQ(contradictory.status, LcpStatus::kInfeasible);
  EXPECT_TRUE(CheckFarkas(doubled, contradictory.farkas));
}

TEST(SolverTest, ContactBesideContradictoryJointsHidesNothing) {
  // v1 = 0 and v1 = 1, and apart from them a contact that holds v2 up.
  MixedLcp<double> problem;
  problem.M = MatrixX<double>::Identity(2, 2);
  problem.p = VectorX<double>{{0.0, -1.0}};
  problem.A = MatrixX<double>{{1.0, 0.0}, {1.0, 0.0}};
  problem.b = VectorX<double>{{0.0, 1.0}};
  problem.G = MatrixX<double>{{0.0, 1.0}};
  problem.F = MatrixX<double>{{0.0}};
  problem.c = VectorX<double>{{0.0}};
  EXPECT_EQ(SolveLcp(problem).status, LcpStatus::kInfeasible);
  // Impulses that cancel, 3e12 against 3e12, do not make the joints hold.
  const VectorX<double> v{{0.5, 0.0}};
  const VectorX<double> z{{1.0}};
  EXPECT_GT(ScaledResidual(problem, v, VectorX<double>{{-3e12, 3e12}}, z), 0.1);
}

TEST(SolverTest, RescalingUnitsChangesNothing) {
  RandomProblem random(9);
  MixedLcp<double> problem = random.Make(4, 1, 6);
  const LcpSolution<double> metres = SolveLcp(problem);
  // Forces times 1e9 and speeds times 1e3.
  problem.M *= 1e6;
  problem.p *= 1e9;
  problem.b *= 1e3;
  problem.c *= 1e3;
  problem.F *= 1e-6;
  const LcpSolution<double> scaled = SolveLcp(problem);
  ASSERT_EQ(scaled.status, LcpStatus::kSolved);
  EXPECT_LT((scaled.v / 1e3 - metres.v).norm(), 1e-12);
  EXPECT_LT((scaled.z / 1e9 - metres.z).norm(), 1e-12);
  EXPECT_NEAR(scaled.iterations, metres.iterations, 3);
}

TEST(ActiveSetTest, PolishCorrectsARoughPoint) {
  RandomProblem random(10);
  const MixedLcp<double> problem = random.Make(5, 1, 8);
  LcpVector rough = random.solution;
  for (double& z : rough.z) z += 1e-2 * (1.0 + random.Uniform());
  const LcpVector polished = Polish(problem, rough);
  EXPECT_LT(ScaledResidual(problem, polished.v, polished.y, polished.z), 1e-15);
}

TEST(ActiveSetTest, PolishNeverMakesItWorse) {
  RandomProblem random(11);
  for (int k = 0; k < 50; ++k) {
    MixedLcp<double> problem = random.Make(3, 1, 5);
    problem.F = random.Matrix(5, 5);  // indefinite: the solution may be out of reach
    const LcpVector from{random.Matrix(3, 1), random.Matrix(1, 1), random.Matrix(5, 1).cwiseAbs()};
    const LcpVector to = Polish(problem, from);
    EXPECT_LE(ScaledResidual(problem, to.v, to.y, to.z),
              ScaledResidual(problem, from.v, from.y, from.z));
    EXPECT_GE(to.z.minCoeff(), 0.0);
  }
}

TEST(ActiveSetTest, EnumerationFindsWhatPathsMiss) {
  MixedLcp<double> problem;
  problem.F = MatrixX<double>{{0.0, 1.0}, {0.0, 0.0}};
  problem.c = VectorX<double>{{-1.0, 0.0}};
  ConformEmptyBlocks(problem);
  const LcpVector point = EnumerateModes(problem, 1e-12);
  EXPECT_LE(ScaledResidual(problem, point.v, point.y, point.z), 1e-12);
}

// z from 1e87 to 1e109 at once: the small ones were taken for rounding of the largest, and s1 = 54
// % of its terms beside z1 > 0 for a solution. The only one is z = (0, 0.519, 0).
TEST(SolverTest, VariablesThatSpanManyDecadesAreNotRounding) {
  MixedLcp<double> problem;
  problem.F =
      MatrixX<double>{{2.5913934256595162e-167, -1.0281187030288061e-83, -20565600.36431228},
                      {-1.0281187030288061e-83, 4.279301235598721, 8.49537365077939e+90},
                      {-20565600.36431228, 8.49537365077939e+90, 2.218101024741997e+181}};
  problem.c = Eigen::Vector3d(382840579789047.1, -2.2204842880442612, -2.864631048892953e+28);
  ConformEmptyBlocks(problem);
  for (const SolverChoice choice :
       {SolverChoice::kAuto, SolverChoice::kInteriorPoint, SolverChoice::kLemke}) {
    const LcpSolution<double> solution = SolveLcp(problem, {.solver = choice});
    if (solution.status != LcpStatus::kSolved) continue;
    EXPECT_EQ(solution.z[0], 0.0);
    EXPECT_NEAR(solution.z[1], 2.2204842880442612 / 4.279301235598721, 1e-15);
    EXPECT_EQ(solution.z[2], 0.0);
  }
  EXPECT_EQ(SolveLcp(problem, {}).status, LcpStatus::kSolved);
}

// Numbers whose products overflow left the interior point without any iterate.
TEST(SolverTest, NumbersThatOverflowAreUnsolved) {
  MixedLcp<double> problem;
  problem.F = MatrixX<double>{{-1e300, 1.0}, {1.0, -4.5e-9}};
  problem.c = Eigen::Vector2d(-1.0, 1e308);
  ConformEmptyBlocks(problem);
  for (const SolverChoice choice :
       {SolverChoice::kAuto, SolverChoice::kInteriorPoint, SolverChoice::kLemke}) {
    const LcpSolution<double> solution = SolveLcp(problem, {.solver = choice});
    EXPECT_NE(solution.status, LcpStatus::kSolved);
    ASSERT_EQ(solution.z.size(), 2);
    EXPECT_TRUE(solution.z.allFinite());
  }
}

}  // namespace
}  // namespace tangible
