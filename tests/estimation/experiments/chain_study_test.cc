// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/chain_study.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(ChainStudyTest, NearStartsReachTheTruth) {
  ChainStudyOptions options;
  options.range = 1.5;
  const ChainStudy study(MakeScene(kSmallChain), 100.0, options);
  ASSERT_EQ(study.num_links(), 3);
  const ChainStart first = study.RunStart(0);
  EXPECT_EQ(first.status, FitStatus::kConverged);
  EXPECT_LT(first.error, 1e-8);
  EXPECT_GT(first.initial_cost, 1.0);
  EXPECT_NE(study.RunStart(1).initial_cost, first.initial_cost) << "each has its own seed";
  EXPECT_EQ(study.RunStart(0).initial_cost, first.initial_cost);
}

TEST(ChainStudyTest, IntervalsCoverAsOftenAsTheySay) {
  ChainStudyOptions options;
  options.replicas = 100;
  const ChainStudy study(MakeScene(kSmallChain), 50.0, options);
  const ChainCoverage coverage = study.CoverageOf(study.RunReplicas([](int) { return true; }));
  EXPECT_EQ(coverage.failed, 0);
  // Binomial of 300, were the links independent: 0.95 ± 4 sqrt(0.95 0.05 / 100).
  EXPECT_NEAR(coverage.Pooled(coverage.covered), 0.95, 0.087);
  EXPECT_NEAR(coverage.Pooled(coverage.covered_robust), 0.95, 0.087);
}

}  // namespace
}  // namespace tangible
