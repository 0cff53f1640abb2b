// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/recordings.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

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
  return RecordingsProblem(std::move(recordings), {false, true, false});
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
    ASSERT_TRUE(problem.EvaluateBlock(block, p, DerivativeMethod::kTangent,
                                      BlockDerivatives::kCompute, &at));
    ASSERT_EQ(at.jacobian.cols(), 3);
    ASSERT_EQ(at.residuals.size(), problem.num_rows(block));
    for (int i = 0; i < 3; ++i) {
      for (const double h : {1e-4, 1e-5}) {
        BlockEvaluation plus, minus;
        Eigen::VectorXd moved = p;
        moved[i] += h;
        ASSERT_TRUE(problem.EvaluateBlock(block, moved, DerivativeMethod::kTangent,
                                          BlockDerivatives::kSkip, &plus));
        moved[i] -= 2.0 * h;
        ASSERT_TRUE(problem.EvaluateBlock(block, moved, DerivativeMethod::kTangent,
                                          BlockDerivatives::kSkip, &minus));
        const Eigen::VectorXd difference = (plus.residuals - minus.residuals) / (2.0 * h);
        EXPECT_GT(difference.norm(), 1e-3);
        EXPECT_LT((at.jacobian.col(i) - difference).norm(), 1e-6 * difference.norm());
      }
    }
  }
}

TEST(RecordingsTest, AFailureNamesItsRecording) {
  RecordingsProblem problem = Throws();
  BlockEvaluation evaluation;
  EXPECT_FALSE(problem.EvaluateBlock(1, Eigen::Vector3d(std::nan(""), 0.0, 0.0),
                                     DerivativeMethod::kTangent, BlockDerivatives::kSkip,
                                     &evaluation));
  EXPECT_EQ(evaluation.message.rfind("recording 'take 1': ", 0), 0u) << evaluation.message;
}

}  // namespace
}  // namespace tangible
