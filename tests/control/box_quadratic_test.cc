// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/box_quadratic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

struct Quadratic {
  MatrixX<double> h;
  VectorX<double> g, low, high;
  double Value(const VectorX<double>& x) const { return g.dot(x) + 0.5 * x.dot(h * x); }
};

Quadratic Random(int m, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(*random); };
  const MatrixX<double> root = MatrixX<double>::NullaryExpr(m, m, draw);
  Quadratic q{root * root.transpose() + 0.01 * MatrixX<double>::Identity(m, m),
              VectorX<double>::NullaryExpr(m, draw), VectorX<double>(m), VectorX<double>(m)};
  for (int i = 0; i < m; ++i) {
    const double a = draw();
    const double b = draw();
    q.low[i] = std::min(a, b);
    q.high[i] = std::max(a, b);
  }
  return q;
}

// The best over all sets of variables that bounds hold: 3^m of them.
VectorX<double> Enumerated(const Quadratic& q) {
  const int m = static_cast<int>(q.g.size());
  VectorX<double> best;
  int sets = 1;
  for (int i = 0; i < m; ++i) sets *= 3;
  for (int set = 0; set < sets; ++set) {
    VectorX<double> x = VectorX<double>::Zero(m);
    std::vector<int> free;
    for (int i = 0, rest = set; i < m; ++i, rest /= 3) {
      if (rest % 3 == 0) {
        free.push_back(i);
      } else {
        x[i] = rest % 3 == 1 ? q.low[i] : q.high[i];
      }
    }
    if (!free.empty()) {
      const MatrixX<double> h = q.h(free, free);
      const VectorX<double> held = q.g + q.h * x;
      x(free) = -h.llt().solve(VectorX<double>(held(free)));
    }
    const bool inside =
        ((x - q.low).array() >= -1e-12).all() && ((q.high - x).array() >= -1e-12).all();
    if (inside && (best.size() == 0 || q.Value(x) < q.Value(best))) best = x;
  }
  return best;
}

TEST(BoxQuadratic, IsTheBestOfAllActiveSets) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 500; ++i) {
    const Quadratic q = Random(1 + i % 5, &random);
    const VectorX<double> start = VectorX<double>::Zero(q.g.size());
    const BoxQuadraticSolution found = SolveBoxQuadratic(q.h, q.g, q.low, q.high, start);
    ASSERT_EQ(found.status, BoxQuadraticStatus::kSolved) << i;
    const VectorX<double> expected = Enumerated(q);
    EXPECT_LT((found.x - expected).norm(), 1e-9 * (1.0 + expected.norm())) << i;
    for (const int k : found.free) {
      EXPECT_NEAR((q.g + q.h * found.x)[k], 0.0, 1e-10 * (1.0 + q.g.norm()));
    }
  }
}

TEST(BoxQuadratic, WithoutBoundsIsNewtonsStep) {
  std::mt19937_64 random(4);
  Quadratic q = Random(4, &random);
  q.low.setConstant(-kInfinity);
  q.high.setConstant(kInfinity);
  const BoxQuadraticSolution found =
      SolveBoxQuadratic(q.h, q.g, q.low, q.high, VectorX<double>::Zero(4));
  ASSERT_EQ(found.status, BoxQuadraticStatus::kSolved);
  EXPECT_LT((q.h * found.x + q.g).norm(), 1e-10);
  EXPECT_EQ(found.free.size(), 4u);
}

TEST(BoxQuadratic, ACurvatureThatIsNotPositiveIsReported) {
  const VectorX<double> zero = VectorX<double>::Zero(1);
  const VectorX<double> one = VectorX<double>::Ones(1);
  const MatrixX<double> h = -MatrixX<double>::Ones(1, 1);
  EXPECT_EQ(SolveBoxQuadratic(h, one, -one, one, zero).status, BoxQuadraticStatus::kIndefinite);
  // Held by both bounds at once it does not matter.
  const BoxQuadraticSolution held = SolveBoxQuadratic(h, one, one, one, zero);
  EXPECT_EQ(held.status, BoxQuadraticStatus::kSolved);
  EXPECT_EQ(held.x[0], 1.0);
  EXPECT_TRUE(held.free.empty());
}

}  // namespace
}  // namespace tangible
