// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/prior.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

TEST(PriorTest, ResidualsAreDeviationsInSigma) {
  const PriorResidual gaussian = EvaluatePrior({PriorKind::kGaussian, 2.0, 0.5}, 3.0);
  EXPECT_EQ(gaussian.residual, 2.0);
  EXPECT_EQ(gaussian.derivative, 2.0);
  const PriorResidual log_normal = EvaluatePrior({PriorKind::kLogNormal, 2.0, 0.1}, 2.0 * M_E);
  EXPECT_NEAR(log_normal.residual, 10.0, 1e-14);
  EXPECT_NEAR(log_normal.derivative, 10.0 / (2.0 * M_E), 1e-14);
  // Half and twice the median are equally far from it.
  EXPECT_NEAR(EvaluatePrior({PriorKind::kLogNormal, 2.0, 0.1}, 1.0).residual,
              -EvaluatePrior({PriorKind::kLogNormal, 2.0, 0.1}, 4.0).residual, 1e-14);
}

}  // namespace
}  // namespace tangible
