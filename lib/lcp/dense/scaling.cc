// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/scaling.h"

#include <cmath>

namespace tangible {
namespace {

double NearestPowerOfTwo(double x) { return std::exp2(std::round(std::log2(x))); }

double InverseRoot(double largest) { return largest > 0.0 ? 1.0 / std::sqrt(largest) : 1.0; }

}  // namespace

Equilibration Equilibrate(const MatrixX<double>& K) {
  constexpr int kPasses = 10;
  Equilibration scaling;
  scaling.row = VectorX<double>::Ones(K.rows());
  scaling.col = VectorX<double>::Ones(K.cols());
  if (K.size() == 0) return scaling;
  for (int pass = 0; pass < kPasses; ++pass) {
    const MatrixX<double> scaled =
        (scaling.row.asDiagonal() * K * scaling.col.asDiagonal()).cwiseAbs();
    scaling.row.array() *= scaled.rowwise().maxCoeff().unaryExpr(&InverseRoot).array();
    scaling.col.array() *= scaled.colwise().maxCoeff().transpose().unaryExpr(&InverseRoot).array();
  }
  scaling.row = scaling.row.unaryExpr(&NearestPowerOfTwo);
  scaling.col = scaling.col.unaryExpr(&NearestPowerOfTwo);
  return scaling;
}

}  // namespace tangible
