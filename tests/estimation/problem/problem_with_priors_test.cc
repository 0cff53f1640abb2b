// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/problem_with_priors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

/// Shared a and m, own c of each of two blocks; rows a − i and c a.
class TwoBlocks : public LeastSquaresProblem {
 public:
  TwoBlocks() {
    for (const char* name : {"a", "m", "c0", "c1"}) {
      entries_.push_back({name, 1.0, 0.0, HUGE_VAL, true, 1.0});
    }
  }
  std::vector<ParameterEntry>& mutable_entries() { return entries_; }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 2; }
  int num_blocks() const override { return 2; }
  int num_own(int /*block*/) const override { return 1; }
  int num_rows(int /*block*/) const override { return 2; }
  double weight(int block) const override { return block == 0 ? 1.0 : 4.0; }
  std::vector<RowPlace> Places(int /*block*/) const override { return {{0, 0.0}, {1, 0.0}}; }
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
    evaluation->residuals = Eigen::Vector2d(p[0] - block, p[2] * p[0]);
    if (derivatives == BlockDerivatives::kCompute) {
      evaluation->jacobian = RowMatrixXd::Zero(2, 3);
      evaluation->jacobian << 1, 0, 0, p[2], 0, p[0];
    }
    return true;
  }

 private:
  std::vector<ParameterEntry> entries_;
};

TEST(ProblemWithPriorsTest, WithoutPriorsNothingChanges) {
  TwoBlocks inner;
  const ProblemWithPriors problem(&inner, {});
  EXPECT_FALSE(problem.HasRows());
  EXPECT_EQ(problem.num_blocks(), 2);
  EXPECT_EQ(problem.num_rows(1), 2);
}

TEST(ProblemWithPriorsTest, RowsAndDerivativesOfPriorsAndEffects) {
  TwoBlocks inner;
  inner.mutable_entries()[0].prior = Prior{PriorKind::kGaussian, 5.0, 2.0};
  inner.mutable_entries()[3].prior = Prior{PriorKind::kLogNormal, 3.0, 0.5};
  for (const PriorKind kind : {PriorKind::kGaussian, PriorKind::kLogNormal}) {
    ProblemWithPriors problem(&inner, {{"c", kind, 1, {2, 3}, 0.1}});
    EXPECT_TRUE(problem.HasRows());
    ASSERT_EQ(problem.num_blocks(), 3);
    EXPECT_EQ(problem.num_rows(0), 3);
    EXPECT_EQ(problem.num_rows(1), 4);
    EXPECT_EQ(problem.num_observation_rows(1), 2);
    EXPECT_EQ(problem.num_rows(2), 1);
    EXPECT_EQ(problem.num_observation_rows(2), 0);
    EXPECT_EQ(problem.num_own(2), 0);
    BlockEvaluation evaluation;
    ASSERT_TRUE(problem.EvaluateBlock(2, Eigen::Vector2d(4.0, 7.0), GradientMethod::kTangent,
                                      BlockDerivatives::kCompute, &evaluation));
    EXPECT_EQ(evaluation.residuals[0], -0.5);
    EXPECT_EQ(evaluation.jacobian, RowMatrixXd(Eigen::RowVector2d(0.5, 0.0)));

    const Eigen::Vector3d p(4.0, 0.8, 1.25);
    ASSERT_TRUE(problem.EvaluateBlock(1, p, GradientMethod::kTangent, BlockDerivatives::kCompute,
                                      &evaluation));
    // The block's weight of 4 is taken out of them.
    const double effect = kind == PriorKind::kGaussian ? 0.45 : std::log(1.25 / 0.8);
    EXPECT_NEAR(evaluation.residuals[2], 0.5 * std::log(1.25 / 3.0) / 0.5, 1e-14);
    EXPECT_NEAR(evaluation.residuals[3], 0.5 * effect / 0.1, 1e-13);
    const double h = 1e-6;
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d plus = p, minus = p;
      plus[k] += h;
      minus[k] -= h;
      BlockEvaluation after, before;
      ASSERT_TRUE(problem.EvaluateBlock(1, plus, GradientMethod::kTangent, BlockDerivatives::kSkip,
                                        &after));
      ASSERT_TRUE(problem.EvaluateBlock(1, minus, GradientMethod::kTangent, BlockDerivatives::kSkip,
                                        &before));
      const Eigen::VectorXd difference = (after.residuals - before.residuals) / (2.0 * h);
      EXPECT_LT((difference - evaluation.jacobian.col(k)).norm(), 1e-8) << k;
    }
    problem.SetSpread(0, 0.2);
    ASSERT_TRUE(problem.EvaluateBlock(1, p, GradientMethod::kTangent, BlockDerivatives::kSkip,
                                      &evaluation));
    EXPECT_NEAR(evaluation.residuals[3], 0.5 * effect / 0.2, 1e-13);
  }
}

}  // namespace
}  // namespace tangible
