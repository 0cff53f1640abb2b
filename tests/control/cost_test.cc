// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/cost.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../support/random_matrix.h"

namespace tangible {
namespace {

Cost EveryKind(bool at_end) {
  std::vector<CostTerm> terms(4);
  terms[0] = {CostTerm::Kind::kState, 3, 0, {0, 0}, 0.2, 1.5, at_end};
  terms[1] = {CostTerm::Kind::kAngle, 2, 0, {0, 0}, 1.0, 0.7, at_end};
  terms[2] = {CostTerm::Kind::kPoint, 0, 0, {0.3, -0.4}, 0.5, 2.0, at_end};
  terms[3] = {CostTerm::Kind::kPoint, 0, 1, {0.3, -0.4}, -0.5, 1.1, at_end};
  if (!at_end) terms.push_back({CostTerm::Kind::kControl, 1, 0, {0, 0}, 0.1, 0.9, false});
  return Cost(6, 2, 0.01, terms);
}

TEST(Cost, DerivativesAreThoseOfItsValue) {
  VectorX<double> x(6);
  x << 0.3, 0.1, 2.4, -0.3, 0.6, 0.2;
  VectorX<double> u(2);
  u << 0.5, -0.2;
  for (const bool at_end : {false, true}) {
    const Cost cost = EveryKind(at_end);
    const auto expand = [&](const VectorX<double>& z, bool exact, CostExpansion* e) {
      const VectorX<double> states = z.head(6);
      const VectorX<double> controls = z.tail(2);
      if (at_end) {
        cost.ExpandEnd(states, exact, e);
        EXPECT_DOUBLE_EQ(e->value, cost.EndValue(states));
        EXPECT_EQ(cost.Value(states, controls), 0.0);
      } else {
        cost.Expand(states, controls, exact, e);
        EXPECT_DOUBLE_EQ(e->value, cost.Value(states, controls));
        EXPECT_EQ(cost.EndValue(states), 0.0);
      }
    };
    VectorX<double> z(8);
    z << x, u;
    CostExpansion e;
    expand(z, true, &e);
    VectorX<double> gradient(8);
    gradient << e.x, e.u;
    MatrixX<double> hessian(8, 8);
    hessian << e.xx, e.ux.transpose(), e.ux, e.uu;
    for (int i = 0; i < 8; ++i) {
      for (const double h : {1e-4, 1e-5}) {
        VectorX<double> plus = z, minus = z;
        plus[i] += h;
        minus[i] -= h;
        CostExpansion a, b;
        expand(plus, false, &a);
        expand(minus, false, &b);
        EXPECT_NEAR(gradient[i], (a.value - b.value) / (2.0 * h), 1e-8);
        VectorX<double> ga(8), gb(8);
        ga << a.x, a.u;
        gb << b.x, b.u;
        EXPECT_LT((hessian.col(i) - (ga - gb) / (2.0 * h)).norm(), 1e-8);
      }
    }
  }
}

TEST(Cost, GaussNewtonHasNoNegativeCurvature) {
  VectorX<double> far(6);
  far << 3.0, -2.0, 4.1, 1.0, 0.6, 0.2;
  CostExpansion e;
  EveryKind(true).ExpandEnd(far, false, &e);
  for (unsigned seed = 0; seed < 200; ++seed) {
    const VectorX<double> v = testing::RandomMatrix(6, 1, seed);
    EXPECT_GE(v.dot(e.xx * v), -1e-12);
  }
}

TEST(Cost, WholeTurnsDoNotCount) {
  const Cost cost(6, 1, 0.01,
                  {{CostTerm::Kind::kAngle, 2, 0, {0, 0}, std::numbers::pi, 1.0, true}});
  VectorX<double> x = VectorX<double>::Zero(6);
  x[2] = -std::numbers::pi;
  EXPECT_NEAR(cost.EndValue(x), 0.0, 1e-30);
  x[2] = 0.0;
  EXPECT_NEAR(cost.EndValue(x), 2.0, 1e-12);
}

// Two steps of 0.01 s and the end: residuals of 1, of the target where that is larger.
TEST(Cost, ValueOfUnitsIsOfResidualsAsLargeAsTheirTargets) {
  const Cost cost(6, 2, 0.01,
                  {{CostTerm::Kind::kState, 3, 0, {0, 0}, -4.0, 1.5, true},
                   {CostTerm::Kind::kControl, 1, 0, {0, 0}, 0.1, 0.8, false}});
  EXPECT_DOUBLE_EQ(cost.ValueOfUnits(2), 0.5 * 1.5 * 16.0 + 2.0 * 0.01 * 0.5 * 0.8);
}

TEST(Cost, KnowsAnAngleHalfATurnFromItsTarget) {
  const auto has = [](double first, double last, bool at_end, double weight) {
    const Cost cost(1, 1, 0.1, {{CostTerm::Kind::kAngle, 0, 0, {0, 0}, 1.0, weight, at_end}});
    RowMatrixXd states(2, 1);
    states << first, last;
    return cost.HasAngleAtMaximum(states);
  };
  EXPECT_TRUE(has(0.0, 1.0 + 3.0 * std::numbers::pi, true, 1.0));
  EXPECT_TRUE(has(1.0 - std::numbers::pi, 0.0, false, 1.0));
  EXPECT_FALSE(has(1.0 - std::numbers::pi, 0.0, true, 1.0));         // not at the end
  EXPECT_FALSE(has(0.0, 1.0 + std::numbers::pi, false, 1.0));        // not in a step
  EXPECT_FALSE(has(0.0, 1.0 + std::numbers::pi, true, 0.0));         // costs nothing
  EXPECT_FALSE(has(0.0, 1.0 + std::numbers::pi + 0.01, true, 1.0));  // its gradient is not zero
}

}  // namespace
}  // namespace tangible
