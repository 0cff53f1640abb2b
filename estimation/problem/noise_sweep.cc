// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/noise_sweep.h"

#include <algorithm>
#include <cmath>

#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

/// The sizes of a problem, and the columns [x | u | p | 1] of a cost to go.
struct Sizes {
  Eigen::Index n = 0, m = 0, p = 0;
  Eigen::Index U() const { return n; }
  Eigen::Index P() const { return n + m; }
  Eigen::Index One() const { return n + m + p; }
};

Sizes SizesOf(const std::vector<NoiseInterval>& intervals, const RowMatrixXd& start) {
  return {start.rows(), intervals.front().force.size(), start.cols()};
}

/// The rows of an interval before their transformation, columns [ε | x | u | p | 1].
void Assemble(const Sizes& s, const NoiseInterval& interval, const Eigen::MatrixXd& to_go,
              Eigen::MatrixXd* rows) {
  const Eigen::Index m = s.m;
  const Eigen::Index observations = interval.rows.rows();
  rows->setZero(m + observations + to_go.rows(), m + s.One() + 1);
  rows->topLeftCorner(m, m).setIdentity();
  rows->col(m + s.One()).head(m) = interval.innovation;
  // By ε and by u at the start of the interval, of what depends on F.
  const Eigen::VectorXd by_drive = interval.size.cwiseProduct(interval.drive);
  const Eigen::VectorXd by_decay = interval.size.cwiseProduct(interval.decay);
  const auto weights = interval.weights.asDiagonal();
  auto seen = rows->middleRows(m, observations);
  const auto by_force = interval.rows.rightCols(m);
  seen.leftCols(m) = weights * by_force * by_drive.asDiagonal();
  seen.middleCols(m, s.n) = weights * interval.rows.middleCols(s.p, s.n);
  seen.middleCols(m + s.U(), m) = weights * by_force * by_decay.asDiagonal();
  seen.middleCols(m + s.P(), s.p) = weights * interval.rows.leftCols(s.p);
  seen.col(m + s.One()) = weights * interval.residuals;
  if (to_go.rows() == 0) return;
  auto behind = rows->bottomRows(to_go.rows());
  const Eigen::MatrixXd moved = to_go.leftCols(s.n) * interval.map;
  const auto by_u = to_go.middleCols(s.U(), m);
  behind.leftCols(m) =
      moved.rightCols(m) * by_drive.asDiagonal() + by_u * interval.drive.asDiagonal();
  behind.middleCols(m, s.n) = moved.middleCols(s.p, s.n);
  behind.middleCols(m + s.U(), m) =
      moved.rightCols(m) * by_decay.asDiagonal() + by_u * interval.decay.asDiagonal();
  behind.middleCols(m + s.P(), s.p) = moved.leftCols(s.p) + to_go.middleCols(s.P(), s.p);
  behind.col(m + s.One()) = to_go.col(s.One());
}

/// Makes the rows upper triangular; those that have nothing but the last column become one number,
/// whose square is returned.
double Triangularise(Eigen::MatrixXd* rows) {
  MakeUpperTriangular(rows);
  const Eigen::Index kept = std::min(rows->rows(), rows->cols() - 1);
  const double rest = rows->rows() > kept ? (*rows)(kept, rows->cols() - 1) : 0.0;
  rows->conservativeResize(kept, Eigen::NoChange);
  return rest * rest;
}

/// −E⁻¹ of the gains times a right-hand side.
template <typename Right>
Eigen::MatrixXd MinusSolve(const RowMatrixXd& gains, const Right& right) {
  const Eigen::Index m = gains.rows();
  return -gains.leftCols(m).template triangularView<Eigen::Upper>().solve(right);
}

}  // namespace

NoiseSweep SweepNoise(const std::vector<NoiseInterval>& intervals, const RowMatrixXd& start) {
  const Sizes s = SizesOf(intervals, start);
  NoiseSweep sweep;
  sweep.gains.resize(intervals.size());
  Eigen::MatrixXd to_go(0, s.One() + 1);
  Eigen::MatrixXd rows;
  double decrement = 0.0;
  for (size_t k = intervals.size(); k-- > 0;) {
    Assemble(s, intervals[k], to_go, &rows);
    sweep.remainder += Triangularise(&rows);
    sweep.gains[k] = rows.topRows(s.m);
    to_go = rows.bottomRightCorner(rows.rows() - s.m, s.One() + 1);
    decrement += sweep.gains[k].rightCols(1).squaredNorm();
    sweep.log_determinant += sweep.gains[k].diagonal().cwiseAbs().array().log().sum();
  }
  sweep.decrement = std::sqrt(decrement);
  // Before the first force u is 0.
  Eigen::MatrixXd border(to_go.rows(), s.p + 1);
  border.leftCols(s.p) = to_go.leftCols(s.n) * start + to_go.middleCols(s.P(), s.p);
  border.col(s.p) = to_go.col(s.One());
  if (border.rows() > 0) sweep.remainder += Triangularise(&border);
  sweep.border = border;
  return sweep;
}

Eigen::VectorXd NoiseStep(const RowMatrixXd& gains, const Eigen::VectorXd& changes) {
  return MinusSolve(gains, gains.rightCols(changes.size()) * changes);
}

void NoiseSensitivity(const std::vector<NoiseInterval>& intervals, const NoiseSweep& sweep,
                      const RowMatrixXd& start, RowMatrixXd* observations,
                      RowMatrixXd* innovations) {
  const Sizes s = SizesOf(intervals, start);
  innovations->resize(static_cast<Eigen::Index>(intervals.size()) * s.m, s.p);
  RowMatrixXd x = start;
  RowMatrixXd u = RowMatrixXd::Zero(s.m, s.p);
  for (size_t k = 0; k < intervals.size(); ++k) {
    const NoiseInterval& interval = intervals[k];
    const RowMatrixXd& gains = sweep.gains[k];
    const Eigen::MatrixXd right = gains.middleCols(s.m, s.n) * x +
                                  gains.middleCols(s.m + s.U(), s.m) * u +
                                  gains.middleCols(s.m + s.P(), s.p);
    auto innovation = innovations->middleRows(static_cast<Eigen::Index>(k) * s.m, s.m);
    innovation = MinusSolve(gains, right);
    u = interval.decay.asDiagonal() * u + interval.drive.asDiagonal() * innovation;
    const RowMatrixXd force = interval.size.asDiagonal() * u;
    for (size_t i = 0; i < interval.observations.size(); ++i) {
      const auto row = interval.rows.row(static_cast<Eigen::Index>(i));
      observations->row(interval.observations[i]) =
          row.head(s.p) + row.segment(s.p, s.n) * x + row.tail(s.m) * force;
    }
    x = (interval.map.middleCols(s.p, s.n) * x + interval.map.rightCols(s.m) * force +
         interval.map.leftCols(s.p))
            .eval();
  }
}

NoiseMoments MomentsOfNoise(const std::vector<NoiseInterval>& intervals, const NoiseSweep& sweep,
                            const RowMatrixXd& start, const Eigen::VectorXd& dp,
                            const RowMatrixXd& p_covariance) {
  const Sizes s = SizesOf(intervals, start);
  const auto count = static_cast<Eigen::Index>(intervals.size());
  NoiseMoments moments;
  moments.force.resize(count, s.m);
  moments.force_deviation.resize(count, s.m);
  moments.state_change.resize(count + 1, s.n);
  moments.state_deviation.resize(count + 1, s.n);
  moments.squares.setZero(s.m);
  // Of z = [x; u; p].
  RowMatrixXd from_p = RowMatrixXd::Zero(s.One(), s.p);
  from_p.topRows(s.n) = start;
  from_p.bottomRows(s.p).setIdentity();
  Eigen::VectorXd mean = from_p * dp;
  RowMatrixXd covariance = from_p * p_covariance * from_p.transpose();
  RowMatrixXd forward = RowMatrixXd::Zero(s.One(), s.One());
  RowMatrixXd noise = RowMatrixXd::Zero(s.One(), s.m);
  const auto deviation = [](const auto& variances) {
    return variances.cwiseMax(0.0).cwiseSqrt().transpose().eval();
  };
  const auto keep_state = [&](Eigen::Index k) {
    moments.state_change.row(k) = mean.head(s.n).transpose();
    moments.state_deviation.row(k) = deviation(covariance.diagonal().head(s.n));
  };
  for (Eigen::Index k = 0; k < count; ++k) {
    const NoiseInterval& interval = intervals[static_cast<size_t>(k)];
    const RowMatrixXd& gains = sweep.gains[static_cast<size_t>(k)];
    keep_state(k);
    const RowMatrixXd by_z = MinusSolve(gains, gains.middleCols(s.m, s.One()));
    const RowMatrixXd own = -MinusSolve(gains, RowMatrixXd::Identity(s.m, s.m));
    Eigen::VectorXd changes(s.One() + 1);
    changes << mean, 1.0;
    const Eigen::VectorXd step = NoiseStep(gains, changes);
    const RowMatrixXd spread = by_z * covariance * by_z.transpose() + own * own.transpose();
    moments.squares += (interval.innovation + step).cwiseAbs2() + spread.diagonal();
    // u after the interval's innovation, then the state at its end.
    RowMatrixXd u = interval.drive.asDiagonal() * by_z;
    u.middleCols(s.U(), s.m).diagonal() += interval.decay;
    const RowMatrixXd u_own = interval.drive.asDiagonal() * own;
    const Eigen::VectorXd u_mean =
        interval.decay.cwiseProduct(mean.segment(s.U(), s.m)) + interval.drive.cwiseProduct(step);
    const RowMatrixXd u_spread = u * covariance * u.transpose() + u_own * u_own.transpose();
    moments.force.row(k) = (interval.force + interval.size.cwiseProduct(u_mean)).transpose();
    moments.force_deviation.row(k) =
        deviation(u_spread.diagonal()).cwiseProduct(interval.size.transpose());
    const RowMatrixXd by_u = interval.map.rightCols(s.m) * interval.size.asDiagonal();
    forward.setZero();
    forward.topRows(s.n) = by_u * u;
    forward.topLeftCorner(s.n, s.n) += interval.map.middleCols(s.p, s.n);
    forward.topRightCorner(s.n, s.p) += interval.map.leftCols(s.p);
    forward.middleRows(s.U(), s.m) = u;
    forward.bottomRightCorner(s.p, s.p).setIdentity();
    noise.topRows(s.n) = by_u * u_own;
    noise.middleRows(s.U(), s.m) = u_own;
    mean.head(s.n) = (interval.map.middleCols(s.p, s.n) * mean.head(s.n) + by_u * u_mean +
                      interval.map.leftCols(s.p) * dp)
                         .eval();
    mean.segment(s.U(), s.m) = u_mean;
    covariance = (forward * covariance * forward.transpose() + noise * noise.transpose()).eval();
  }
  keep_state(count);
  return moments;
}

}  // namespace tangible
