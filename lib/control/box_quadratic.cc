// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/box_quadratic.h"

#include <cmath>

#include "tangible/control/tolerances.h"

namespace tangible {
namespace {

constexpr int kMaxIterations = 100;
constexpr int kMaxHalvings = 60;

VectorX<double> Clamped(const VectorX<double>& x, const VectorX<double>& low,
                        const VectorX<double>& high) {
  return x.cwiseMax(low).cwiseMin(high);
}

class Search {
 public:
  Search(const MatrixX<double>& h, const VectorX<double>& g, const VectorX<double>& low,
         const VectorX<double>& high)
      : h_(h), g_(g), low_(low), high_(high) {}

  // False where nothing is left to do, with the status set.
  bool Iterate(BoxQuadraticSolution* solution) {
    const VectorX<double>& x = solution->x;
    const VectorX<double> gradient = g_ + h_ * x;
    const std::vector<int> before = solution->free;
    FindFree(x, gradient, &solution->free);
    if (solution->iterations == 0 || solution->free != before) {
      if (!Factor(solution)) return false;
    }
    if (IsStationary(gradient, *solution)) {
      solution->status = BoxQuadraticStatus::kSolved;
      return false;
    }
    VectorX<double> direction = VectorX<double>::Zero(x.size());
    direction(solution->free) = -solution->factor.Solve(VectorX<double>(gradient(solution->free)));
    if (!Move(gradient, direction, &solution->x)) {
      // The remaining gradient is rounding.
      solution->status = BoxQuadraticStatus::kSolved;
      return false;
    }
    return true;
  }

 private:
  void FindFree(const VectorX<double>& x, const VectorX<double>& gradient,
                std::vector<int>* free) const {
    free->clear();
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const bool held = (x[i] <= low_[i] && gradient[i] > 0.0) ||
                        (x[i] >= high_[i] && gradient[i] < 0.0) || low_[i] == high_[i];
      if (!held) free->push_back(static_cast<int>(i));
    }
  }

  bool Factor(BoxQuadraticSolution* solution) const {
    solution->factor.Compute(h_(solution->free, solution->free));
    if (!solution->free.empty() && !solution->factor.succeeded()) {
      solution->status = BoxQuadraticStatus::kIndefinite;
      return false;
    }
    return true;
  }

  bool IsStationary(const VectorX<double>& gradient, const BoxQuadraticSolution& solution) const {
    const VectorX<double> terms = g_.cwiseAbs() + h_.cwiseAbs() * solution.x.cwiseAbs();
    for (const int i : solution.free) {
      if (!(std::abs(gradient[i]) <= kFreeGradient * terms[i])) return false;
    }
    return true;
  }

  double Value(const VectorX<double>& x) const { return g_.dot(x) + 0.5 * x.dot(h_ * x); }

  bool Move(const VectorX<double>& gradient, const VectorX<double>& direction,
            VectorX<double>* x) const {
    const double value = Value(*x);
    double share = 1.0;
    for (int k = 0; k < kMaxHalvings; ++k, share *= 0.5) {
      const VectorX<double> tried = Clamped(*x + share * direction, low_, high_);
      const double expected = gradient.dot(tried - *x);
      if (expected < 0.0 && Value(tried) - value <= kSufficientDecrease * expected) {
        *x = tried;
        return true;
      }
    }
    return false;
  }

  const MatrixX<double>& h_;
  const VectorX<double>& g_;
  const VectorX<double>& low_;
  const VectorX<double>& high_;
};

}  // namespace

BoxQuadraticSolution SolveBoxQuadratic(const MatrixX<double>& h, const VectorX<double>& g,
                                       const VectorX<double>& low, const VectorX<double>& high,
                                       const VectorX<double>& start) {
  BoxQuadraticSolution solution;
  solution.x = Clamped(start, low, high);
  Search search(h, g, low, high);
  while (solution.iterations < kMaxIterations && search.Iterate(&solution)) ++solution.iterations;
  return solution;
}

}  // namespace tangible
