// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/solver.h"

#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "tangible/lcp/active_set.h"
#include "tangible/lcp/farkas.h"
#include "tangible/lcp/interior_point.h"
#include "tangible/lcp/lemke.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Tells modes apart down to scaled margins of 1e-10.
constexpr double kComplementarity = 1e-20;

// Few, so that a wrong guess costs no more than a few iterations of the interior point.
constexpr int kGuessRounds = 4;

// One run of the portfolio: the attempts so far and the best point.
class Portfolio {
 public:
  Portfolio(const MixedLcp<double>& problem, const LcpOptions& options)
      : problem_(problem), options_(options) {
    solution_.v = VectorXd::Zero(problem.num_v());
    solution_.y = VectorXd::Zero(problem.num_y());
    solution_.z = VectorXd::Zero(problem.num_z());
    solution_.residual = ScaledResidual(problem, solution_.v, solution_.y, solution_.z);
  }

  // From z = 0, v and y without impulses.
  bool TryGuess() {
    const VectorXd zero = VectorXd::Zero(problem_.num_z());
    return Offer({solution_.v, solution_.y, zero}, LcpSolver::kGuess, kGuessRounds);
  }

  bool TryInteriorPoint(double start, double min_centring) {
    const InteriorPointOptions settings{.max_iterations = options_.max_iterations,
                                        .complementarity = kComplementarity,
                                        .start = start,
                                        .min_centring = min_centring};
    const auto result = SolveInteriorPoint(problem_, settings);
    solution_.iterations += result.iterations;
    return Offer({result.v, result.y, result.z}, LcpSolver::kInteriorPoint);
  }

  // `shift` > 0 solves for F + shift diag(W) first, whose path is shorter, and polishes that.
  bool TryLemke(const VectorXd& covering, double shift) {
    if (!reduced_tried_) reduced_ = ReduceToPlain(problem_);
    reduced_tried_ = true;
    if (!reduced_) return false;
    Eigen::MatrixXd W = reduced_->W;
    const double size = W.size() > 0 ? W.cwiseAbs().maxCoeff() : 0.0;
    W.diagonal().array() += shift * size;
    const LemkeResult result = SolveLemke(W, reduced_->q, {.max_pivots = 0, .covering = covering});
    solution_.iterations += result.pivots;
    return Offer({reduced_->v0 + reduced_->v_z * result.z, reduced_->y0 + reduced_->y_z * result.z,
                  result.z},
                 LcpSolver::kLemke);
  }

  bool TryEnumeration() {
    if (problem_.num_z() > kMaxEnumeratedRows) return false;
    return Offer(EnumerateModes(problem_, options_.tolerance), LcpSolver::kEnumeration);
  }

  bool ProveInfeasible() {
    solution_.farkas = FindFarkas(problem_);
    if (solution_.farkas.size() == 0) return false;
    solution_.status = LcpStatus::kInfeasible;
    solution_.message = "no v, y, z >= 0 satisfies the equations with s >= 0";
    return true;
  }

  LcpSolution<double> Finish() {
    solution_.s = Slack(problem_, solution_.v, solution_.z);
    if (solution_.status == LcpStatus::kUnsolved) {
      solution_.solver = LcpSolver::kNone;
      solution_.message = "no attempt reached the tolerance";
    } else if (solution_.status == LcpStatus::kInfeasible) {
      solution_.solver = LcpSolver::kNone;
    }
    return std::move(solution_);
  }

 private:
  bool Offer(const LcpVector& point, LcpSolver solver, int max_rounds = 30) {
    if (!point.v.allFinite() || !point.y.allFinite() || !point.z.allFinite()) return false;
    const LcpVector polished = Polish(problem_, point, max_rounds);
    const double residual = ScaledResidual(problem_, polished.v, polished.y, polished.z);
    if (residual < solution_.residual || solution_.solver == LcpSolver::kNone) {
      solution_.v = polished.v;
      solution_.y = polished.y;
      solution_.z = polished.z;
      solution_.residual = residual;
      solution_.solver = solver;
    }
    if (!(residual <= options_.tolerance)) return false;
    if (!DependsOnData(problem_, polished.v, polished.y, polished.z, residual)) return false;
    solution_.status = LcpStatus::kSolved;
    return true;
  }

  const MixedLcp<double>& problem_;
  const LcpOptions& options_;
  std::optional<ReducedLcp> reduced_;
  bool reduced_tried_ = false;
  LcpSolution<double> solution_;
};

bool TryInteriorPoints(Portfolio& portfolio) {
  for (const auto& [start, centring] :
       {std::pair{1.0, 0.2}, {100.0, 0.1}, {1e-2, 0.3}, {1e4, 0.5}}) {
    if (portfolio.TryInteriorPoint(start, centring)) return true;
  }
  return false;
}

// Covering vectors between 0.1 and 10, log-uniform, from a literal seed; then proximal shifts.
bool TryLemkes(Portfolio& portfolio, Index nz) {
  constexpr int kCoverings = 8;
  std::mt19937 generator(20240607);
  for (int k = 0; k < kCoverings; ++k) {
    VectorXd covering(nz);
    for (double& d : covering) {
      d = std::pow(10.0, 2.0 * (static_cast<double>(generator()) / 4294967296.0) - 1.0);
    }
    if (portfolio.TryLemke(covering, 0.0)) return true;
  }
  for (const double shift : {1e-8, 1e-6, 1e-4}) {
    if (portfolio.TryLemke(VectorXd(), shift)) return true;
  }
  return false;
}

bool RunPortfolio(Portfolio& portfolio, const LcpOptions& options, Index nz) {
  const bool interior_point = options.solver != SolverChoice::kLemke;
  const bool lemke = options.solver != SolverChoice::kInteriorPoint;
  if (options.solver == SolverChoice::kAuto && portfolio.TryGuess()) return true;
  if (interior_point && portfolio.TryInteriorPoint(1.0, 0.0)) return true;
  if (lemke && portfolio.TryLemke(VectorXd(), 0.0)) return true;
  if (portfolio.ProveInfeasible()) return false;
  if (interior_point && TryInteriorPoints(portfolio)) return true;
  if (lemke && TryLemkes(portfolio, nz)) return true;
  return options.solver == SolverChoice::kAuto && portfolio.TryEnumeration();
}

}  // namespace

LcpSolution<double> SolveLcp(const MixedLcp<double>& problem, const LcpOptions& options) {
  LcpSolution<double> refused;
  refused.message = ValidateProblem(problem);
  if (!refused.message.empty()) return refused;
  MixedLcp<double> conformed = problem;
  ConformEmptyBlocks(conformed);
  Portfolio portfolio(conformed, options);
  RunPortfolio(portfolio, options, conformed.num_z());
  return portfolio.Finish();
}

}  // namespace tangible
