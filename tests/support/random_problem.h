// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random mixed LCPs with a known, strictly complementary solution, and perturbations of their data.

#include <Eigen/Core>
#include <random>

#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"

namespace tangible {

class RandomProblem {
 public:
  explicit RandomProblem(unsigned seed) : generator_(seed) {}

  double Uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(generator_); }

  MatrixX<double> Matrix(Eigen::Index rows, Eigen::Index cols) {
    return MatrixX<double>::NullaryExpr(rows, cols, [this] { return Uniform(); });
  }

  /// M positive definite, F with positive definite symmetric part and a large skew one. The
  /// solution is `solution`; every other row is active; margins are between 0.5 and 1.5.
  MixedLcp<double> Make(Eigen::Index nv, Eigen::Index ny, Eigen::Index nz) {
    MixedLcp<double> problem;
    const MatrixX<double> root = Matrix(nv, nv);
    problem.M = root * root.transpose() + MatrixX<double>::Identity(nv, nv);
    problem.A = Matrix(ny, nv);
    problem.G = Matrix(nz, nv);
    const MatrixX<double> skew = Matrix(nz, nz);
    problem.F = 0.5 * MatrixX<double>::Identity(nz, nz) + skew - skew.transpose();
    solution = {Matrix(nv, 1), Matrix(ny, 1), VectorX<double>::Zero(nz)};
    VectorX<double> s = VectorX<double>::Zero(nz);
    for (Eigen::Index i = 0; i < nz; ++i) (i % 2 == 0 ? solution.z : s)[i] = 1.0 + 0.5 * Uniform();
    problem.p = problem.M * solution.v - problem.A.transpose() * solution.y -
                problem.G.transpose() * solution.z;
    problem.b = problem.A * solution.v;
    problem.c = s - problem.G * solution.v - problem.F * solution.z;
    return problem;
  }

  /// Entries in [-1, 1], M's symmetric.
  MixedLcp<double> Perturbation(const MixedLcp<double>& like) {
    MixedLcp<double> change;
    const MatrixX<double> m = Matrix(like.M.rows(), like.M.cols());
    change.M = 0.5 * (m + m.transpose());
    change.p = Matrix(like.p.size(), 1);
    change.A = Matrix(like.A.rows(), like.A.cols());
    change.b = Matrix(like.b.size(), 1);
    change.G = Matrix(like.G.rows(), like.G.cols());
    change.F = Matrix(like.F.rows(), like.F.cols());
    change.c = Matrix(like.c.size(), 1);
    return change;
  }

  LcpVector solution;

 private:
  std::mt19937 generator_;
};

/// problem + h change.
inline MixedLcp<double> Moved(const MixedLcp<double>& problem, const MixedLcp<double>& change,
                              double h) {
  return {problem.M + h * change.M, problem.p + h * change.p, problem.A + h * change.A,
          problem.b + h * change.b, problem.G + h * change.G, problem.F + h * change.F,
          problem.c + h * change.c};
}

}  // namespace tangible
