// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/active_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tangible/lcp/dense/nnls.h"
#include "tangible/lcp/dense/scaling.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The point plus the correction with which it satisfies the equations of `modes`.
LcpVector SolveModes(const MixedLcp<double>& problem, const std::vector<RowMode>& modes,
                     const LcpVector& from) {
  LcpVector point = from;
  for (Index i = 0; i < point.z.size(); ++i) {
    if (modes[i] == RowMode::kInactive) point.z[i] = 0.0;
  }
  const ModeSystem system(problem, modes, VectorXd::Zero(point.z.size()));
  // The second pass corrects the rounding error of the first.
  for (int pass = 0; pass < 2; ++pass) {
    const LcpVector missing{problem.p - problem.M * point.v + problem.A.transpose() * point.y +
                                problem.G.transpose() * point.z,
                            problem.b - problem.A * point.v, -Slack(problem, point.v, point.z)};
    const LcpVector correction = system.Solve(missing);
    point.v += correction.v;
    point.y += correction.y;
    point.z += correction.z;
  }
  return point;
}

struct SignCheck {
  int violations = 0;
  Index worst = -1;
};

// Finds the rows whose sign is wrong by more than rounding and flips their modes (only the worst
// one if `only_worst`).
enum class Flip { kAll, kWorst };
SignCheck FlipWrongSigns(const MixedLcp<double>& problem, const LcpVector& point, Flip flip,
                         std::vector<RowMode>& modes) {
  const LcpScales scales = ComputeScales(problem, point.v, point.y, point.z);
  const VectorXd s = Slack(problem, point.v, point.z);
  SignCheck check;
  double worst = kLcpRounding;
  std::vector<RowMode> flipped = modes;
  for (Index i = 0; i < s.size(); ++i) {
    const bool active = modes[i] == RowMode::kActive;
    const double violation =
        active ? -Ratio(point.z[i], scales.force[i]) : -Ratio(s[i], scales.slack[i]);
    if (!(violation > kLcpRounding)) continue;
    ++check.violations;
    flipped[i] = active ? RowMode::kInactive : RowMode::kActive;
    if (violation > worst) {
      worst = violation;
      check.worst = i;
    }
  }
  if (flip == Flip::kAll) {
    modes = flipped;
  } else if (check.worst >= 0) {
    modes[check.worst] = flipped[check.worst];
  }
  return check;
}

// Keeps the better of two points. A point that solves the equations of its modes, with exact zeros,
// is preferred to one whose residual is lower only by rounding.
class Best {
 public:
  Best(const MixedLcp<double>& problem, LcpVector point)
      : problem_(problem), point_(std::move(point)) {
    point_.z = point_.z.cwiseMax(0.0);
    residual_ = ScaledResidual(problem_, point_.v, point_.y, point_.z) + kPolishPreference;
    ConsiderWithoutNegligible(point_);
  }
  void Offer(LcpVector point) {
    point.z = point.z.cwiseMax(0.0);
    Consider(point);
    ConsiderWithoutNegligible(std::move(point));
  }
  double Residual() const { return residual_; }
  const LcpVector& Point() const { return point_; }

 private:
  void ConsiderWithoutNegligible(LcpVector point) {
    // An impulse that is a remainder of rounding, such as 1e-48, can be as large as the other terms
    // of its cone row: it would count in full as a violation of that row.
    const LcpScales scales = ComputeScales(problem_, point.v, point.y, point.z);
    for (const double negligible : kNegligibleImpulses) {
      if (residual_ <= 2.0 * negligible) return;
      bool cleaned = false;
      for (Index i = 0; i < point.z.size(); ++i) {
        if (point.z[i] == 0.0 || point.z[i] > negligible * scales.force[i]) continue;
        point.z[i] = 0.0;
        cleaned = true;
      }
      if (cleaned) Consider(point);
    }
  }

  void Consider(const LcpVector& point) {
    const double residual = ScaledResidual(problem_, point.v, point.y, point.z);
    if (residual < residual_) {
      residual_ = residual;
      point_ = point;
    }
  }

  const MixedLcp<double>& problem_;
  LcpVector point_;
  double residual_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<RowMode> IdentifyModes(const MixedLcp<double>& problem, const LcpVector& point) {
  const LcpScales scales = ComputeScales(problem, point.v, point.y, point.z);
  const VectorXd s = Slack(problem, point.v, point.z);
  std::vector<RowMode> modes(s.size(), RowMode::kInactive);
  for (Index i = 0; i < s.size(); ++i) {
    if (Ratio(point.z[i], scales.force[i]) > Ratio(s[i], scales.slack[i])) {
      modes[i] = RowMode::kActive;
    }
  }
  return modes;
}

LcpVector Polish(const MixedLcp<double>& problem, const LcpVector& point, int max_rounds) {
  const LcpVector best = Best(problem, point).Point();
  return Polish(problem, best, max_rounds, IdentifyModes(problem, best));
}

LcpVector Polish(const MixedLcp<double>& problem, const LcpVector& point, int max_rounds,
                 std::vector<RowMode> modes) {
  Best best(problem, point);
  LcpVector current = best.Point();
  int fewest = std::numeric_limits<int>::max();
  int patience = 3;
  for (int round = 0; round < max_rounds; ++round) {
    current = SolveModes(problem, modes, current);
    if (!current.v.allFinite() || !current.y.allFinite() || !current.z.allFinite()) break;
    best.Offer(current);
    // All wrong rows are flipped at once while that makes progress, then one by one (both may be
    // needed: the first is fast, the second cycles less).
    const SignCheck check =
        FlipWrongSigns(problem, current, patience > 0 ? Flip::kAll : Flip::kWorst, modes);
    if (check.violations == 0) break;
    if (check.violations < fewest) {
      fewest = check.violations;
    } else {
      --patience;
    }
    current.z = current.z.cwiseMax(0.0);
  }
  return best.Point();
}

LcpVector EnumerateModes(const MixedLcp<double>& problem, double tolerance) {
  const Index nz = problem.num_z();
  const Index num_free = problem.num_v() + problem.num_y();
  const auto [E, f] = AllEquations(problem);
  Best best(problem,
            {VectorXd::Zero(problem.num_v()), VectorXd::Zero(problem.num_y()), VectorXd::Zero(nz)});
  // v, y, and z of active or s of inactive rows.
  std::vector<Index> columns(num_free + nz);
  std::iota(columns.begin(), columns.end(), 0);
  for (unsigned set = 0; set < (1U << nz) && best.Residual() > tolerance; ++set) {
    const auto active = [set](Index i) { return ((set >> i) & 1U) != 0; };
    for (Index i = 0; i < nz; ++i) {
      columns[num_free + i] = num_free + i + (active(i) ? 0 : nz);
    }
    const MatrixXd system = E(Eigen::all, columns);
    const Equilibration scaling = Equilibrate(system);
    VectorXd x = SolveNnls(scaling.row.asDiagonal() * system * scaling.col.asDiagonal(),
                           scaling.row.cwiseProduct(f), num_free)
                     .x;
    x = scaling.col.cwiseProduct(x);
    for (Index i = 0; i < nz; ++i) {
      x[num_free + i] = active(i) ? x[num_free + i] : 0.0;
    }
    if (x.allFinite()) {
      best.Offer(
          {x.head(problem.num_v()), x.segment(problem.num_v(), problem.num_y()), x.tail(nz)});
    }
  }
  return best.Point();
}

}  // namespace tangible
