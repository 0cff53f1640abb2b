// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/dense_lu.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace tangible {
template <typename T>
bool DenseLu<T>::Compute(const MatrixX<T>& matrix) {
  const Eigen::Index n = matrix.rows();
  lu_ = matrix;
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  double smallest = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index pivot = k;
    for (Eigen::Index i = k + 1; i < n; ++i) {
      if (std::abs(ValueOf(lu_(i, k))) > std::abs(ValueOf(lu_(pivot, k)))) pivot = i;
    }
    const double size = std::abs(ValueOf(lu_(pivot, k)));
    if (!(size > 0.0) || !std::isfinite(size)) return false;
    smallest = std::min(smallest, size);
    largest = std::max(largest, size);
    if (pivot != k) {
      lu_.row(k).swap(lu_.row(pivot));
      std::swap(order_[k], order_[pivot]);
    }
    const T inverse = 1.0 / lu_(k, k);
    const Eigen::Index rest = n - k - 1;
    for (Eigen::Index i = k + 1; i < n; ++i) lu_(i, k) = lu_(i, k) * inverse;
    for (Eigen::Index j = k + 1; j < n; ++j) {
      const T factor = lu_(k, j);
      lu_.col(j).tail(rest) -= lu_.col(k).tail(rest) * factor;
    }
  }
  pivot_ratio_ = n == 0 ? 1.0 : smallest / largest;
  return true;
}

template <typename T>
VectorX<T> DenseLu<T>::Solve(const VectorX<T>& r) const {
  const Eigen::Index n = lu_.rows();
  VectorX<T> x(n);
  for (Eigen::Index i = 0; i < n; ++i) x[i] = r[order_[i]];
  for (Eigen::Index j = 0; j < n; ++j) {
    const T xj = x[j];
    x.tail(n - j - 1) -= lu_.col(j).tail(n - j - 1) * xj;
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    x[j] = x[j] / lu_(j, j);
    const T xj = x[j];
    x.head(j) -= lu_.col(j).head(j) * xj;
  }
  return x;
}

template <typename T>
VectorX<T> DenseLu<T>::SolveTransposed(const VectorX<T>& r) const {
  const Eigen::Index n = lu_.rows();
  VectorX<T> w = r;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < j; ++i) w[j] = w[j] - lu_(i, j) * w[i];
    w[j] = w[j] / lu_(j, j);
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    for (Eigen::Index i = j + 1; i < n; ++i) w[j] = w[j] - lu_(i, j) * w[i];
  }
  VectorX<T> x(n);
  for (Eigen::Index i = 0; i < n; ++i) x[order_[i]] = w[i];
  return x;
}

template class DenseLu<double>;
#define TANGIBLE_INSTANTIATE(N) template class DenseLu<Jet<(N)>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
