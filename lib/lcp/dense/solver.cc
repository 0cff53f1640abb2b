// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/solver.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "tangible/lcp/dense/active_set.h"
#include "tangible/lcp/dense/farkas.h"
#include "tangible/lcp/dense/interior_point.h"
#include "tangible/lcp/dense/lemke.h"
#include "tangible/lcp/dense/scaling.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// The number is small, so that a wrong guess costs no more than a few interior-point iterations.
constexpr int kGuessRounds = 4;

// Maximum number of proximal steps.
constexpr int kProximalRounds = 24;
// From this round on different fractions of the least shift are used in turn against cycling: modes
// that alternate from round to round with one shift usually settle with another.
constexpr int kCyclingRound = 9;
constexpr double kSharesAgainstCycling[] = {0.1, 0.01, 1.0};
constexpr int kBasisRounds = 5;

// Proximal steps go on, at most this many rounds, until the residual is this fraction of the
// tolerance.
constexpr double kRoom = 0.01;
constexpr int kRoundsForRoom = 4;

// How often `change` can be repeated until the first z is at 0; at most 1e6 times.
double LimitedBy(const VectorXd& z, const VectorXd& change) {
  double factor = 1e6;
  for (Index i = 0; i < z.size(); ++i) {
    if (z[i] > 0.0 && change[i] < 0.0) factor = std::min(factor, -z[i] / change[i]);
  }
  return factor;
}

// One run of the portfolio; it holds the attempts so far and the best point.
class Portfolio {
 public:
  Portfolio(const MixedLcp<double>& problem, const LcpOptions& options)
      : problem_(problem), options_(options) {
    solution_.v = VectorXd::Zero(problem.num_v());
    solution_.y = VectorXd::Zero(problem.num_y());
    solution_.z = VectorXd::Zero(problem.num_z());
    solution_.residual = ScaledResidual(problem, solution_.v, solution_.y, solution_.z);
  }

  // Starts from z = 0 and the v and y without impulses.
  bool TryGuess() {
    const VectorXd zero = VectorXd::Zero(problem_.num_z());
    return Offer({solution_.v, solution_.y, zero}, LcpSolver::kGuess, kGuessRounds);
  }

  bool TryInteriorPoint() {
    const InteriorPointOptions settings{.max_iterations = options_.max_iterations,
                                        .complementarity = kComplementarityGoal};
    const auto result = SolveInteriorPoint(problem_, settings);
    solution_.iterations += result.iterations;
    return Offer({result.v, result.y, result.z}, LcpSolver::kInteriorPoint);
  }

  bool TryLemke(const VectorXd& covering) {
    if (!Reduce()) return false;
    const LemkeResult result =
        SolveLemke(reduced_->W, reduced_->q, {.max_pivots = 0, .covering = covering});
    solution_.iterations += result.pivots;
    return Offer(PointOf(result.z), LcpSolver::kLemke);
  }

  // Proximal steps: in each, Lemke's method solves a problem regularised around the last solution.
  // Where rows are redundant, the LCP with the rounded W may have no solution although the exact
  // one has.
  bool TryProximalLemke(double least_shift) {
    if (!Reduce()) return false;
    const Equilibration scaling = Equilibrate(reduced_->W);
    const VectorXd unit = (scaling.row.cwiseProduct(scaling.col)).cwiseInverse();
    VectorXd z = VectorXd::Zero(problem_.num_z());
    VectorXd basic = z;
    VectorXd last_change = z;
    double shift = kFirstShift;
    int solved = 0;
    for (int round = 0; round < kProximalRounds; ++round) {
      Eigen::MatrixXd W = reduced_->W;
      W.diagonal() += shift * unit;
      const VectorXd q = reduced_->q - shift * unit.cwiseProduct(z);
      if (!SolveProximal(W, q, &basic)) break;
      const VectorXd last = z;
      z = basic;
      const LcpVector point = PointOf(z);
      if (Judge(point, LcpSolver::kLemke) || Offer(point, LcpSolver::kLemke) ||
          OfferBasis(point, LcpSolver::kLemke)) {
        // The point is just within the tolerance: a few more rounds leave a margin for a stricter
        // check of the residual.
        if (solution_.residual <= kRoom * options_.tolerance || ++solved == kRoundsForRoom) {
          return true;
        }
      }
      const VectorXd change = z - last;
      // Rows contradict each other by rounding: impulses grow by the same amount in each round
      // until one of them reaches its limit.
      if (round > 0 && (change - last_change).norm() <= 0.01 * change.norm()) {
        z = (z + LimitedBy(z, change) * change).cwiseMax(0.0);
      }
      last_change = change;
      shift = round < kCyclingRound ? std::max(least_shift, 0.1 * shift)
                                    : least_shift * kSharesAgainstCycling[round % 3];
    }
    return solved > 0;
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
      solution_.message = solution_.residual <= options_.tolerance
                              ? "what meets the tolerance does so without the constants p, b, c too"
                              : "no attempt reached the tolerance";
    } else if (solution_.status == LcpStatus::kInfeasible) {
      solution_.solver = LcpSolver::kNone;
    }
    return std::move(solution_);
  }

 private:
  // Starts from the basis z > 0 of the last proximal step, or follows a whole path; then it solves
  // once more from the basis where that ended, to remove the rounding of its pivots.
  bool SolveProximal(const Eigen::MatrixXd& W, const VectorXd& q, VectorXd* z) {
    const LemkeOptions options{.max_pivots = 0, .covering = VectorXd()};
    LemkeResult result = SolveLemkeFrom(*z, W, q, options);
    solution_.iterations += result.pivots;
    if (result.status != LemkeStatus::kSolved) {
      result = SolveLemke(W, q, options);
      solution_.iterations += result.pivots;
      if (result.status != LemkeStatus::kSolved) return false;
    }
    const LemkeResult again = SolveLemkeFrom(result.z, W, q, options);
    solution_.iterations += again.pivots;
    *z = again.status == LemkeStatus::kSolved ? again.z : result.z;
    return true;
  }

  bool Reduce() {
    if (!reduced_tried_) reduced_ = ReduceToPlain(problem_);
    reduced_tried_ = true;
    return reduced_.has_value();
  }

  // The point of the full problem that belongs to z of the reduced one, with the v and y that z
  // causes.
  LcpVector PointOf(const VectorXd& z) const {
    return {reduced_->v0 + reduced_->v_z * z, reduced_->y0 + reduced_->y_z * z, z};
  }

  bool Offer(const LcpVector& point, LcpSolver solver, int max_rounds = 30) {
    if (!point.v.allFinite() || !point.y.allFinite() || !point.z.allFinite()) return false;
    return Judge(Polish(problem_, point, max_rounds), solver);
  }

  // The same, with the rows in the basis, z > 0, as the active ones.
  bool OfferBasis(const LcpVector& point, LcpSolver solver) {
    std::vector<RowMode> modes;
    for (const double z : point.z) modes.push_back(z > 0.0 ? RowMode::kActive : RowMode::kInactive);
    return Judge(Polish(problem_, point, kBasisRounds, modes), solver);
  }

  bool Judge(const LcpVector& polished, LcpSolver solver) {
    return JudgeAsIs(polished, solver) || JudgeAsIs(WithoutRounding(polished), solver);
  }

  // Sets entries to 0 that are mere rounding beside the others: z compared with those of its kind,
  // y, and v by its share of the energy. A row that contains nothing else (the friction limit of a
  // vanishing impulse, the slip of a body at rest) would otherwise be scaled by that rounding.
  LcpVector WithoutRounding(LcpVector point) const {
    const LcpScales scales = ComputeScales(problem_, point.v, point.y, point.z);
    for (Index i = 0; i < point.z.size(); ++i) {
      if (std::abs(point.z[i]) <= kLcpRounding * scales.force[i]) point.z[i] = 0.0;
    }
    const VectorXd root_mass = problem_.M.diagonal().cwiseMax(0.0).cwiseSqrt();
    const double root_energy = point.v.cwiseAbs().dot(root_mass);
    for (Index j = 0; j < point.v.size(); ++j) {
      if (std::abs(point.v[j]) * root_mass[j] <= kLcpRounding * root_energy) point.v[j] = 0.0;
    }
    const double largest = point.y.size() > 0 ? point.y.cwiseAbs().maxCoeff() : 0.0;
    for (double& y : point.y) {
      if (std::abs(y) <= kLcpRounding * largest) y = 0.0;
    }
    return point;
  }

  bool JudgeAsIs(const LcpVector& polished, LcpSolver solver) {
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

// Tries proximal steps, then covering vectors between 0.1 and 10, log-uniform, from a literal seed.
bool TryLemkes(Portfolio& portfolio, Index nz) {
  constexpr int kCoverings = 8;
  std::mt19937 generator(20240607);
  const auto draw = [&] {
    VectorXd covering(nz);
    for (double& d : covering) {
      d = std::pow(10.0, 2.0 * (static_cast<double>(generator()) / 4294967296.0) - 1.0);
    }
    return covering;
  };
  for (const double least_shift : kLeastShifts) {
    if (portfolio.TryProximalLemke(least_shift)) return true;
  }
  for (int k = 0; k < kCoverings; ++k) {
    if (portfolio.TryLemke(draw())) return true;
  }
  return false;
}

bool RunPortfolio(Portfolio& portfolio, const LcpOptions& options, Index nz) {
  const bool interior_point = options.solver != SolverChoice::kLemke;
  const bool lemke = options.solver != SolverChoice::kInteriorPoint;
  if (options.solver == SolverChoice::kAuto && portfolio.TryGuess()) return true;
  if (interior_point && portfolio.TryInteriorPoint()) return true;
  if (lemke && portfolio.TryLemke(VectorXd())) return true;
  if (portfolio.ProveInfeasible()) return false;
  if (!options.further_attempts) return false;
  if (lemke && TryLemkes(portfolio, nz)) return true;
  return options.solver == SolverChoice::kAuto && portfolio.TryEnumeration();
}

// Solves a plain problem whose z span many decades in equilibrated units, in which an entry is
// small if it is small beside the largest z. Empty where equilibration is not needed, or would
// overflow.
std::optional<LcpSolution<double>> SolveEquilibrated(const MixedLcp<double>& problem,
                                                     const LcpOptions& options) {
  constexpr double kWide = 1e6;
  if (problem.num_v() > 0 || problem.num_z() == 0) return std::nullopt;
  const Equilibration scaling = Equilibrate(problem.F);
  if (scaling.col.maxCoeff() <= kWide * scaling.col.minCoeff()) return std::nullopt;
  MixedLcp<double> scaled = problem;
  scaled.F = scaling.row.asDiagonal() * problem.F * scaling.col.asDiagonal();
  scaled.c = scaling.row.cwiseProduct(problem.c);
  if (!scaled.F.allFinite() || !scaled.c.allFinite()) return std::nullopt;
  Portfolio portfolio(scaled, options);
  RunPortfolio(portfolio, options, scaled.num_z());
  LcpSolution<double> solution = portfolio.Finish();
  solution.z = scaling.col.cwiseProduct(solution.z);
  solution.s = Slack(problem, solution.v, solution.z);
  if (solution.farkas.size() > 0) solution.farkas = scaling.row.cwiseProduct(solution.farkas);
  if (!solution.z.allFinite() || !solution.s.allFinite() || !solution.farkas.allFinite()) {
    return std::nullopt;
  }
  return solution;
}

}  // namespace

LcpSolution<double> SolveLcp(const MixedLcp<double>& problem, const LcpOptions& options) {
  LcpSolution<double> refused;
  refused.message = ValidateProblem(problem);
  if (!refused.message.empty()) return refused;
  MixedLcp<double> conformed = problem;
  ConformEmptyBlocks(conformed);
  if (std::optional<LcpSolution<double>> solution = SolveEquilibrated(conformed, options)) {
    return *std::move(solution);
  }
  Portfolio portfolio(conformed, options);
  RunPortfolio(portfolio, options, conformed.num_z());
  return portfolio.Finish();
}

}  // namespace tangible
