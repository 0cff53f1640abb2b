// SPDX-License-Identifier: Apache-2.0
// Unrolled and implicit Jets against each other and against exact derivatives.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "../../support/random_problem.h"
#include "../../support/step_cases.h"
#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

// The problem whose k-th derivative parts are changes[k].
template <int N>
MixedLcp<Jet<N>> WithDerivatives(const MixedLcp<double>& problem,
                                 const std::vector<MixedLcp<double>>& changes) {
  const auto fill = [&changes](const auto& values, auto block, auto& target) {
    target = values.template cast<Jet<N>>();
    for (std::size_t k = 0; k < changes.size(); ++k) {
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        target.data()[i].v[static_cast<int>(k)] = block(changes[k]).data()[i];
      }
    }
  };
  MixedLcp<Jet<N>> jets;
  fill(
      problem.M, [](const auto& d) -> const auto& { return d.M; }, jets.M);
  fill(
      problem.p, [](const auto& d) -> const auto& { return d.p; }, jets.p);
  fill(
      problem.A, [](const auto& d) -> const auto& { return d.A; }, jets.A);
  fill(
      problem.b, [](const auto& d) -> const auto& { return d.b; }, jets.b);
  fill(
      problem.G, [](const auto& d) -> const auto& { return d.G; }, jets.G);
  fill(
      problem.F, [](const auto& d) -> const auto& { return d.F; }, jets.F);
  fill(
      problem.c, [](const auto& d) -> const auto& { return d.c; }, jets.c);
  return jets;
}

template <int N>
void CheckRandom() {
  RandomProblem random(1);
  for (int k = 0; k < 10; ++k) {
    const MixedLcp<double> problem = random.Make(4, 2, 6);
    const std::vector<MixedLcp<double>> changes{random.Perturbation(problem),
                                                random.Perturbation(problem)};
    const auto jets = WithDerivatives<N>(problem, changes);
    const auto implicit = SolveImplicit(jets);
    const auto unrolled = SolveUnrolled(jets);
    ASSERT_EQ(implicit.status, LcpStatus::kSolved);
    ASSERT_EQ(unrolled.status, LcpStatus::kSolved);
    EXPECT_EQ(unrolled.solver, LcpSolver::kInteriorPoint);
    const LcpDerivative derivative(problem, random.solution);
    for (int l = 0; l < 2; ++l) {
      const LcpVector exact = derivative.Tangent(changes[l]);
      const double size = exact.v.norm() + exact.y.norm() + exact.z.norm();
      for (Eigen::Index i = 0; i < 4; ++i) {
        EXPECT_NEAR(implicit.v[i].v[l], exact.v[i], 1e-11 * size);
        EXPECT_NEAR(unrolled.v[i].v[l], exact.v[i], 1e-7 * size);
      }
      for (Eigen::Index i = 0; i < 6; ++i) {
        EXPECT_NEAR(unrolled.z[i].v[l], exact.z[i], 1e-7 * size);
        EXPECT_NEAR(unrolled.s[i].v[l], implicit.s[i].v[l], 1e-7 * size);
      }
    }
  }
}

// Bodies at rest, sticking, sliding, redundant, near switches: every two-sided derivative.
template <int N>
void CheckSteps() {
  for (const StepCase& step : StepCases()) {
    std::vector<std::string> parameters;
    for (const auto& [name, exact] : step.data()["gradient"].items()) parameters.push_back(name);
    for (std::size_t at = 0; at < parameters.size(); at += N) {
      const std::size_t count = std::min<std::size_t>(N, parameters.size() - at);
      std::vector<MixedLcp<double>> changes;
      for (std::size_t k = 0; k < count; ++k) {
        changes.push_back(step.Perturbation(parameters[at + k]));
      }
      const auto jets = WithDerivatives<N>(step.problem(), changes);
      const auto implicit = SolveImplicit(jets);
      const auto unrolled = SolveUnrolled(jets);
      for (std::size_t k = 0; k < count; ++k) {
        SCOPED_TRACE(step.id() + " " + parameters[at + k]);
        const VectorX<double> exact = ToVector(step.data()["gradient"][parameters[at + k]]);
        const double size = std::max(1.0, exact.cwiseAbs().maxCoeff());
        for (Eigen::Index i = 0; i < exact.size(); ++i) {
          EXPECT_NEAR(implicit.v[i].v[static_cast<int>(k)], exact[i], 1e-9 * size);
          EXPECT_NEAR(unrolled.v[i].v[static_cast<int>(k)], exact[i], 1e-6 * size);
        }
      }
    }
  }
}

#define TANGIBLE_TEST(N)                                         \
  TEST(JetSolverTest, RandomProblems##N) { CheckRandom<(N)>(); } \
  TEST(JetSolverTest, StepsAndTheirKinks##N) { CheckSteps<(N)>(); }
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_TEST)

}  // namespace
}  // namespace tangible
