// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/interior_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/lcp/dense/dense_lu.h"
#include "tangible/lcp/dense/scaling.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

template <typename T>
double LargestValue(const VectorX<T>& x) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double size = std::abs(ValueOf(x[i]));
    if (!(size <= largest)) largest = size;  // keeps NaN
  }
  return largest;
}

/// The equilibrated problem K x − (0, 0, s) = q, x = (v, y, z), and one run on it.
template <typename T>
class InteriorPoint {
 public:
  InteriorPoint(const MixedLcp<T>& problem, const InteriorPointOptions& options)
      : options_(options),
        nv_(problem.num_v()),
        num_equations_(problem.num_v() + problem.num_y()),
        nz_(problem.num_z()) {
    Assemble(problem);
  }

  InteriorPointResult<T> Run() {
    InteriorPointResult<T> result;
    Start();
    double best = std::numeric_limits<double>::infinity();
    // This is the result if numbers overflow in the first iteration, before any iterate is stored.
    result.v = VectorX<T>::Constant(nv_, T(0.0));
    result.y = VectorX<T>::Constant(num_equations_ - nv_, T(0.0));
    result.z = VectorX<T>::Constant(nz_, T(0.0));
    for (; result.iterations <= options_.max_iterations; ++result.iterations) {
      const VectorX<T> r = Residual();
      const T kappa = Complementarity(z_, s_);
      const double missed = LargestValue(r);
      // The residual counts only above its goal, so that a further decrease of κ is still seen as
      // progress.
      const double merit = std::max(missed, options_.residual) + ValueOf(kappa);
      if (!std::isfinite(merit)) break;
      if (merit <= best) {
        best = merit;
        Store(result);
      }
      result.converged = missed <= options_.residual && ValueOf(kappa) <= options_.complementarity;
      if (result.converged || result.iterations == options_.max_iterations) break;
      if (!Iterate(r, kappa)) break;
    }
    if (result.converged) FinishDerivatives(result);
    return result;
  }

 private:
  void Assemble(const MixedLcp<T>& problem) {
    const Eigen::Index n = num_equations_ + nz_;
    const Eigen::Index ny = num_equations_ - nv_;
    K_ = MatrixX<T>::Constant(n, n, T(0.0));
    K_.topLeftCorner(nv_, nv_) = problem.M;
    K_.block(0, nv_, nv_, ny) = -problem.A.transpose();
    K_.topRightCorner(nv_, nz_) = -problem.G.transpose();
    K_.block(nv_, 0, ny, nv_) = problem.A;
    K_.bottomLeftCorner(nz_, nv_) = problem.G;
    K_.bottomRightCorner(nz_, nz_) = problem.F;
    q_.resize(n);
    q_ << problem.p, problem.b, -problem.c;

    const MatrixX<double> values = K_.unaryExpr([](const T& x) { return ValueOf(x); });
    const Equilibration scaling = Equilibrate(values);
    col_ = scaling.col;
    for (Eigen::Index i = 0; i < n; ++i) {
      q_[i] *= scaling.row[i];
      for (Eigen::Index j = 0; j < n; ++j) K_(i, j) *= scaling.row[i] * scaling.col[j];
    }
    // The data are scaled to size 1; x and s are proportional to q.
    const double size = LargestValue(q_);
    if (size > 0.0) {
      for (Eigen::Index i = 0; i < n; ++i) q_[i] *= 1.0 / size;
      col_ *= size;
    }
  }

  void Start() {
    x_ = VectorX<T>::Constant(num_equations_, T(0.0));
    z_ = VectorX<T>::Constant(nz_, T(1.0));
    s_ = VectorX<T>::Constant(nz_, T(1.0));
  }

  // (0, 0, s) + q − K x: by how much each equation is missed.
  VectorX<T> Residual() const {
    VectorX<T> r = q_;
    r.tail(nz_) += s_;
    for (Eigen::Index j = 0; j < num_equations_; ++j) r -= K_.col(j) * x_[j];
    for (Eigen::Index j = 0; j < nz_; ++j) r -= K_.col(num_equations_ + j) * z_[j];
    return r;
  }

  T Complementarity(const VectorX<T>& z, const VectorX<T>& s) const {
    T sum(0.0);
    for (Eigen::Index i = 0; i < nz_; ++i) sum += z[i] * s[i];
    return nz_ == 0 ? sum : sum * (1.0 / static_cast<double>(nz_));
  }

  bool Factorise() {
    MatrixX<T> newton = K_;
    for (Eigen::Index i = 0; i < num_equations_; ++i) newton(i, i) += kNewtonShift;
    for (Eigen::Index i = 0; i < nz_; ++i) {
      const Eigen::Index row = num_equations_ + i;
      const T weight = 1.0 / (z_[i] + s_[i]);
      const T z_weight = z_[i] * weight;
      for (Eigen::Index j = 0; j < newton.cols(); ++j) newton(row, j) *= z_weight;
      newton(row, row) += s_[i] * weight;
    }
    return lu_.Compute(newton);
  }

  struct Direction {
    VectorX<T> dx;
    VectorX<T> dz;
    VectorX<T> ds;
  };

  // The Newton step for residual r and D(z) ds + D(s) dz = rc.
  Direction Solve(const VectorX<T>& r, const VectorX<T>& rc) const {
    VectorX<T> rhs = r;
    for (Eigen::Index i = 0; i < nz_; ++i) {
      rhs[num_equations_ + i] = (rc[i] + z_[i] * r[num_equations_ + i]) / (z_[i] + s_[i]);
    }
    const VectorX<T> step = lu_.Solve(rhs);
    Direction direction{step.head(num_equations_), step.tail(nz_), -r.tail(nz_)};
    for (Eigen::Index j = 0; j < step.size(); ++j) {
      direction.ds += K_.col(j).tail(nz_) * step[j];
    }
    return direction;
  }

  // The largest step ≤ limit that keeps z and s ≥ 0.
  T LargestStep(const Direction& direction) const {
    T step(1e10);
    const auto shorten = [&step](const T& x, const T& dx) {
      if (!(ValueOf(dx) < 0.0)) return;
      const T candidate = -x / dx;
      if (ValueOf(candidate) < ValueOf(step)) step = candidate;
    };
    for (Eigen::Index i = 0; i < nz_; ++i) {
      shorten(z_[i], direction.dz[i]);
      shorten(s_[i], direction.ds[i]);
    }
    return step;
  }

  void Move(const Direction& direction, const T& step) {
    x_ += direction.dx * step;
    z_ += direction.dz * step;
    s_ += direction.ds * step;
  }

  // One predictor-corrector step. False if the matrix is singular or the step is lost.
  bool Iterate(const VectorX<T>& r, const T& kappa) {
    if (!Factorise()) return false;
    const T one(1.0);
    VectorX<T> rc(nz_);
    for (Eigen::Index i = 0; i < nz_; ++i) rc[i] = -z_[i] * s_[i];
    const Direction affine = Solve(r, rc);
    if (nz_ == 0) {
      Move(affine, one);
      return true;
    }
    T step = LargestStep(affine);
    if (ValueOf(step) > 1.0) step = one;
    const T kappa_affine = Complementarity(z_ + affine.dz * step, s_ + affine.ds * step);
    const T ratio = kappa_affine / kappa;
    T centring = ratio * ratio * ratio;
    if (ValueOf(centring) > 1.0) centring = one;
    for (Eigen::Index i = 0; i < nz_; ++i) {
      rc[i] = centring * kappa - z_[i] * s_[i] - affine.dz[i] * affine.ds[i];
    }
    const Direction direction = Solve(r, rc);
    // The step is a fixed fraction of the way to the boundary; near the end the fraction tends to
    // 1, which makes convergence superlinear.
    const double fraction = std::max(0.99, 1.0 - ValueOf(kappa));
    step = LargestStep(direction) * fraction;
    if (ValueOf(step) > 1.0) step = one;
    if (!(ValueOf(step) > kLeastStep)) return false;
    Move(direction, step);
    return true;
  }

  // Values converge before derivatives: Newton steps at fixed κ until those of the central path at
  // κ are reached. Two steps are needed, because derivatives lag one step behind a quadratic
  // convergence.
  void FinishDerivatives(InteriorPointResult<T>& result) {
    if (NumDerivatives<T>::value == 0 || nz_ == 0) return;
    for (int k = 0; k < 2; ++k) {
      if (!Factorise()) return;
      VectorX<T> rc(nz_);
      for (Eigen::Index i = 0; i < nz_; ++i) {
        const double target = ValueOf(z_[i]) * ValueOf(s_[i]);
        rc[i] = T(target) - z_[i] * s_[i];
      }
      const Direction direction = Solve(Residual(), rc);
      if (!(ValueOf(LargestStep(direction)) > 1.0)) return;
      Move(direction, T(1.0));
    }
    Store(result);
  }

  void Store(InteriorPointResult<T>& result) const {
    result.v = x_.head(nv_).cwiseProduct(col_.head(nv_).template cast<T>());
    result.y = x_.tail(num_equations_ - nv_)
                   .cwiseProduct(col_.segment(nv_, num_equations_ - nv_).template cast<T>());
    result.z = z_.cwiseProduct(col_.tail(nz_).template cast<T>());
  }

  InteriorPointOptions options_;
  Eigen::Index nv_;
  Eigen::Index num_equations_;  // of (1) and (2)
  Eigen::Index nz_;
  MatrixX<T> K_;
  VectorX<T> q_;
  VectorX<double> col_;  // x = col ∘ scaled x
  VectorX<T> x_;         // (v, y)
  VectorX<T> z_;
  VectorX<T> s_;
  DenseLu<T> lu_;
};

}  // namespace

template <typename T>
InteriorPointResult<T> SolveInteriorPoint(const MixedLcp<T>& problem,
                                          const InteriorPointOptions& options) {
  return InteriorPoint<T>(problem, options).Run();
}

#define TANGIBLE_INSTANTIATE(T)                                          \
  template InteriorPointResult<T> SolveInteriorPoint(const MixedLcp<T>&, \
                                                     const InteriorPointOptions&);
TANGIBLE_INSTANTIATE(double)
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<(N)>)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)
#undef TANGIBLE_INSTANTIATE_JET
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
