// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/prediction.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(PredictionTest, LaterObservationsAreTakenInTheirOrder) {
  std::vector<Observation> observations;
  for (const double time : {0.3, 0.1, 0.5, 0.2, 0.4}) {
    observations.push_back({time, 0, -1, Coordinate::kX, time, 1.0});
  }
  const std::vector<Observation> later = TakeLater(0.3, &observations);
  ASSERT_EQ(observations.size(), 3u);
  EXPECT_EQ(observations[0].time, 0.3);  // included
  EXPECT_EQ(observations[2].time, 0.2);
  ASSERT_EQ(later.size(), 2u);
  EXPECT_EQ(later[0].time, 0.5);
}

TEST(PredictionTest, ErrorsAreSummedByHorizonAndUnit) {
  const std::vector<Observation> observations = {{1.1, 0, -1, Coordinate::kX, 0.0, 0.1},
                                                 {1.1, 0, -1, Coordinate::kY, 0.0, 0.1},
                                                 {3.0, 0, -1, Coordinate::kX, 0.0, 0.1},
                                                 {3.0, 0, -1, Coordinate::kAngle, 0.0, 0.5}};
  const std::vector<Channel> direct;
  const Eigen::VectorXd residuals = Eigen::Vector4d(3.0, -4.0, 5.0, 2.0);
  const PredictionScore score = ScorePrediction({{1.0, observations, direct, residuals}});
  EXPECT_EQ(score.all.count, 4);
  EXPECT_DOUBLE_EQ(score.all.rms_in_sigma, std::sqrt((9.0 + 16.0 + 25.0 + 4.0) / 4.0));
  EXPECT_DOUBLE_EQ(score.all.max_length, 0.5);
  EXPECT_DOUBLE_EQ(score.all.max_angle, 1.0);
  // Twentieths of 2 s: 0.1 s is in the first, 2 s in the last; those between are empty.
  ASSERT_EQ(score.horizons.size(), 2u);
  EXPECT_EQ(score.horizons[0].from, 0.0);
  EXPECT_DOUBLE_EQ(score.horizons[0].to, 0.1);
  EXPECT_EQ(score.horizons[0].count, 2);
  EXPECT_DOUBLE_EQ(score.horizons[0].rms_length, 0.1 * std::sqrt(12.5));
  EXPECT_TRUE(std::isnan(score.horizons[0].rms_angle));
  EXPECT_EQ(score.horizons[1].to, 2.0);
  EXPECT_DOUBLE_EQ(score.horizons[1].rms_angle, 1.0);
}

/// Gravity from the first half of a fall, which the second half continues.
TEST(PredictionTest, WhatIsFittedPredictsWhatFollows) {
  FitProblem problem;
  problem.scene = MakeScene(kFallingBall);
  problem.parameters = {Parameter("gravity/y", -9.0)};
  problem.observations = Observe(problem.scene, 10, 0.0, 1);
  std::vector<Observation> later = TakeLater(0.5, &problem.observations);
  ASSERT_FALSE(later.empty());
  later.back().value += 0.25;  // an angle
  RolloutResiduals residuals =
      MakeResiduals(problem.scene, problem.points, problem.parameters, problem.observations);
  residuals.SetFiles({"fall,1.csv"});
  const FitResult result = Fit(problem.options, &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const LaterObservations predicted = PredictLater(problem, result.estimate, 0.5, later);
  EXPECT_EQ(predicted.score.message, "");
  EXPECT_LT(predicted.score.all.max_length, 1e-9);
  EXPECT_NEAR(predicted.score.all.max_angle, 0.25, 1e-12);

  const PredictedRecordings all{{predicted}, predicted.score};
  const std::string csv =
      PredictionCsv(RecordingsProblem(std::move(residuals)), result.residuals, &all, nullptr);
  EXPECT_EQ(
      csv.rfind("time,target,relative_to,coordinate,file,sensor,used,sigma,observed,predicted,"
                "residual,residual_in_sigma\n0,ball,,x,\"fall,1.csv\",,fit,0.001,0,0,0,0\n",
                0),
      0u)
      << csv;
  EXPECT_NE(csv.find("\n1,ball,,angle,\"fall,1.csv\",,prediction,0.001,0.25,0,-0.25,-250\n"),
            std::string::npos)
      << csv;
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'),
            static_cast<long>(1 + problem.observations.size() + later.size()));
}

TEST(PredictionTest, NamesWithCommasAreQuoted) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<RecordedRun> runs;
  runs.push_back(
      {"a, \"b\"", 1.0,
       MakeResiduals(scene, {}, {Parameter("gravity/y", -9.0)}, Observe(scene, 10, 0.0, 1))});
  const RecordingsProblem problem(std::move(runs), {ParameterScope()});
  const std::string csv =
      PredictionCsv(problem, Eigen::VectorXd::Zero(problem.num_rows(0)), nullptr, nullptr);
  EXPECT_NE(csv.find("\n\"a, \"\"b\"\"\",0,ball,"), std::string::npos) << csv;
}

TEST(PredictionTest, ARunThatFailsIsSaid) {
  FitProblem problem;
  problem.scene = MakeScene(kFallingBall);
  FitParameter mass = Parameter("bodies/ball/mass", 2.0);
  problem.parameters = {mass};
  problem.observations = Observe(problem.scene, 10, 0.0, 1);
  std::vector<Observation> later = TakeLater(0.5, &problem.observations);
  const LaterObservations predicted =
      PredictLater(problem, Eigen::VectorXd::Constant(1, -1.0), 0.5, later);
  EXPECT_NE(predicted.score.message, "");
  EXPECT_EQ(predicted.residuals.size(), 0);
  const RecordingsProblem residuals(
      MakeResiduals(problem.scene, problem.points, problem.parameters, problem.observations));
  const PredictedRecordings all{{predicted}, predicted.score};
  const std::string csv =
      PredictionCsv(residuals, Eigen::VectorXd::Zero(residuals.num_rows(0)), &all, nullptr);
  EXPECT_NE(csv.find("prediction,0.001,0,,,\n"), std::string::npos) << csv;
}

}  // namespace
}  // namespace tangible
