// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/recordings.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/linearisation.h"

namespace tangible {
namespace {

// Three throws of a ball: gravity and damping are shared, the speed is each one's own and stands
// between them in the file.
RecordingsProblem Throws() {
  std::vector<RecordedRun> recordings;
  for (int k = 0; k < 3; ++k) {
    Scene scene = MakeScene(kFallingBall);
    const std::vector<Observation> observations = Observe(scene, 10, 0.01, 5 + k);
    recordings.push_back({"take " + std::to_string(k), 1.0 + k,
                          MakeResiduals(scene, {},
                                        {Parameter("gravity/y", -9.0 - k),
                                         Parameter("bodies/ball/velocity/x", 0.3 + 0.1 * k),
                                         Parameter("gravity/x", 0.1)},
                                        observations)});
  }
  std::vector<ParameterScope> scopes(3);
  scopes[1].kind = ParameterScope::Kind::kOwn;
  return RecordingsProblem(std::move(recordings), scopes);
}

TEST(RecordingsTest, SharedParametersStandFirst) {
  const RecordingsProblem problem = Throws();
  ASSERT_EQ(problem.num_blocks(), 3);
  EXPECT_EQ(problem.num_shared(), 2);
  EXPECT_EQ(problem.num_own(1), 1);
  ASSERT_EQ(problem.entries().size(), 5u);
  EXPECT_EQ(problem.entries()[1].name, "gravity/x");
  EXPECT_EQ(problem.entries()[3].name,
            problem.recordings()[1].residuals.entries()[1].name + " of take 1");
  EXPECT_EQ(problem.ParameterOf(2, 0), 0);
  EXPECT_EQ(problem.ParameterOf(2, 1), 4);
  EXPECT_EQ(problem.ParameterOf(2, 2), 1);
  const Eigen::VectorXd p = Eigen::VectorXd::LinSpaced(5, 1.0, 5.0);
  EXPECT_EQ(problem.ParametersOf(1, p), Eigen::Vector3d(1.0, 4.0, 2.0));
  EXPECT_EQ(problem.weight(2), 3.0);
  EXPECT_EQ(problem.BlockName(2), "recording 'take 2': ");
}

TEST(RecordingsTest, DerivativesAreThoseOfTheRows) {
  RecordingsProblem problem = Throws();
  const Eigen::VectorXd p = Eigen::Vector3d(-9.3, 0.2, 0.45);
  for (int block = 0; block < 3; ++block) {
    BlockEvaluation at;
    ASSERT_TRUE(
        problem.EvaluateBlock(block, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &at));
    ASSERT_EQ(at.jacobian.cols(), 3);
    ASSERT_EQ(at.residuals.size(), problem.num_rows(block));
    for (int i = 0; i < 3; ++i) {
      for (const double h : {1e-4, 1e-5}) {
        BlockEvaluation plus, minus;
        Eigen::VectorXd moved = p;
        moved[i] += h;
        ASSERT_TRUE(problem.EvaluateBlock(block, moved, GradientMethod::kTangent,
                                          BlockDerivatives::kSkip, &plus));
        moved[i] -= 2.0 * h;
        ASSERT_TRUE(problem.EvaluateBlock(block, moved, GradientMethod::kTangent,
                                          BlockDerivatives::kSkip, &minus));
        const Eigen::VectorXd difference = (plus.residuals - minus.residuals) / (2.0 * h);
        EXPECT_GT(difference.norm(), 1e-3);
        EXPECT_LT((at.jacobian.col(i) - difference).norm(), 1e-6 * difference.norm());
      }
    }
  }
}

// What varies has a value of each recording and a shared one, on which no observation depends.
TEST(RecordingsTest, WhatVariesHasASharedValueToo) {
  std::vector<RecordedRun> runs;
  const Scene scene = MakeScene(kFallingBall);
  FitParameter speed = Parameter("bodies/ball/velocity/x", 0.5);
  speed.prior = Prior{PriorKind::kGaussian, 0.4, 0.1};
  for (int k = 0; k < 2; ++k) {
    runs.push_back({k == 0 ? "a" : "b", 1.0,
                    MakeResiduals(scene, {}, {speed, Parameter("gravity/y", -9.0)},
                                  Observe(scene, 10, 0.01, 5 + k))});
  }
  std::vector<ParameterScope> scopes(2);
  scopes[0] = {ParameterScope::Kind::kVaries, PriorKind::kGaussian, 0.25};
  RecordingsProblem problem(std::move(runs), scopes);
  ASSERT_EQ(problem.entries().size(), 4u);
  EXPECT_EQ(problem.num_shared(), 2);
  EXPECT_EQ(problem.order(), (std::vector<int>{-1, 1, 0}));
  EXPECT_TRUE(problem.entries()[0].prior);  // of the shared value alone
  EXPECT_FALSE(problem.entries()[2].prior);
  ASSERT_EQ(problem.effects().size(), 1u);
  EXPECT_EQ(problem.effects()[0].mean, 0);
  EXPECT_EQ(problem.effects()[0].own, (std::vector<int>{2, 3}));
  EXPECT_EQ(problem.effects()[0].spread, 0.25);
  EXPECT_FALSE(problem.EstimatesSpread(0));
  EXPECT_EQ(problem.IndexInRecording(0), 0);
  EXPECT_EQ(problem.IndexInRecording(3), 0);
  EXPECT_EQ(problem.RecordingOf(1), -1);
  EXPECT_EQ(problem.RecordingOf(3), 1);
  BlockEvaluation block;
  ASSERT_TRUE(problem.EvaluateBlock(1, Eigen::Vector3d(7.0, -9.5, 0.6), GradientMethod::kTangent,
                                    BlockDerivatives::kCompute, &block));
  EXPECT_EQ(block.jacobian.col(0).norm(), 0.0);
  EXPECT_GT(block.jacobian.col(2).norm(), 1.0);
  const Eigen::VectorXd p = Eigen::Vector4d(7.0, -9.5, 0.6, 0.7);
  EXPECT_EQ(problem.ParametersOf(1, p), Eigen::Vector2d(0.7, -9.5));
  problem.SetInitial(p);
  EXPECT_EQ(InitialOf(problem.entries()), p);
  EXPECT_EQ(problem.recordings()[0].residuals.entries()[0].initial, 0.6);
}

TEST(RecordingsTest, AFailureNamesItsRecording) {
  RecordingsProblem problem = Throws();
  BlockEvaluation evaluation;
  EXPECT_FALSE(problem.EvaluateBlock(1, Eigen::Vector3d(std::nan(""), 0.0, 0.0),
                                     GradientMethod::kTangent, BlockDerivatives::kSkip,
                                     &evaluation));
  EXPECT_NE(evaluation.message, "");
  Linearizer linearizer(&problem, GradientMethod::kTangent, 1, nullptr);
  std::vector<BlockEvaluation> blocks;
  Eigen::VectorXd p = InitialOf(problem.entries());
  p[3] = std::nan("");
  EXPECT_FALSE(linearizer.Rows(p, BlockDerivatives::kSkip, &blocks));
  EXPECT_EQ(linearizer.message(), "recording 'take 1': " + evaluation.message);
}

}  // namespace
}  // namespace tangible
