// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/dense_lu.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "../../support/random_problem.h"
#include "tangible/lcp/dense/scaling.h"

namespace tangible {
namespace {

TEST(DenseLuTest, SolvesBothWays) {
  RandomProblem random(1);
  const MatrixX<double> K = random.Matrix(7, 7);
  const VectorX<double> r = random.Matrix(7, 1);
  DenseLu<double> lu;
  ASSERT_TRUE(lu.Compute(K));
  // Condition of this matrix is below 100: 100 · 7 eps.
  EXPECT_LT((K * lu.Solve(r) - r).norm(), 2e-13);
  EXPECT_LT((K.transpose() * lu.SolveTransposed(r) - r).norm(), 2e-13);
}

TEST(DenseLuTest, RefusesSingularAndNotFinite) {
  DenseLu<double> lu;
  EXPECT_FALSE(lu.Compute(MatrixX<double>::Zero(3, 3)));
  EXPECT_FALSE(lu.Compute(MatrixX<double>::Constant(2, 2, NAN)));
  EXPECT_TRUE(lu.Compute(MatrixX<double>(0, 0)));
}

// The derivative of K⁻¹ r is K⁻¹ (dr − dK x), also where r and x and entries of K are zero.
template <int N>
void CheckZeroValuedEntries() {
  RandomProblem random(2);
  MatrixX<double> K = random.Matrix(5, 5);
  K(0, 0) = 0.0;
  K(3, 1) = 0.0;
  const MatrixX<double> dK = random.Matrix(5, 5);
  const VectorX<double> dr = random.Matrix(5, 1);
  VectorX<double> r = VectorX<double>::Zero(5);
  r[2] = 1.0;
  MatrixX<Jet<N>> jet_K = K.cast<Jet<N>>();
  VectorX<Jet<N>> jet_r = r.cast<Jet<N>>();
  for (Eigen::Index i = 0; i < 5; ++i) {
    jet_r[i].v[N - 1] = dr[i];
    for (Eigen::Index j = 0; j < 5; ++j) jet_K(i, j).v[N - 1] = dK(i, j);
  }
  DenseLu<Jet<N>> lu;
  ASSERT_TRUE(lu.Compute(jet_K));
  const VectorX<Jet<N>> x = lu.Solve(jet_r);
  const VectorX<Jet<N>> w = lu.SolveTransposed(jet_r);
  const VectorX<double> value = K.fullPivLu().solve(r);
  const VectorX<double> expected = K.fullPivLu().solve(dr - dK * value);
  const MatrixX<double> Kt = K.transpose();
  const VectorX<double> value_t = Kt.fullPivLu().solve(r);
  const VectorX<double> expected_t = Kt.fullPivLu().solve(dr - dK.transpose() * value_t);
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_NEAR(x[i].a, value[i], 1e-12);
    EXPECT_NEAR(x[i].v[N - 1], expected[i], 1e-12 * expected.norm());
    EXPECT_NEAR(w[i].v[N - 1], expected_t[i], 1e-12 * expected_t.norm());
  }
}
#define TANGIBLE_TEST(N) \
  TEST(DenseLuTest, ZeroValuedEntriesKeepTheirDerivatives##N) { CheckZeroValuedEntries<(N)>(); }
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_TEST)

TEST(ScalingTest, BringsEntriesNearOneExactly) {
  RandomProblem random(3);
  MatrixX<double> K = random.Matrix(6, 6);
  K.row(2) *= 1e6;
  K.col(4) *= 1e-5;
  K.row(5).setZero();
  const Equilibration scaling = Equilibrate(K);
  const MatrixX<double> scaled =
      (scaling.row.asDiagonal() * K * scaling.col.asDiagonal()).cwiseAbs();
  for (Eigen::Index i = 0; i < 5; ++i) {
    // Rounding the factors to powers of two leaves a factor of 2 either way.
    EXPECT_LE(scaled.row(i).maxCoeff(), 2.1);
    EXPECT_GE(scaled.row(i).maxCoeff(), 0.4);
    int exponent = 0;
    EXPECT_EQ(std::frexp(scaling.row[i], &exponent), 0.5);
  }
  EXPECT_TRUE(scaling.row.allFinite() && scaling.col.allFinite());
}

}  // namespace
}  // namespace tangible
