// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/residual_summary.h"

#include <gtest/gtest.h>

#include "../../support/fit_results.h"

namespace tangible {
namespace {

TEST(ResidualSummaryTest, EachCoordinateHasItsOwnNumbers) {
  RecordingsProblem residuals = HandMadeProblem();
  residuals.run(0)->SetFiles({"a.csv"});
  // x has 3 at 0.5 s and 4 at 1 s with a sigma of 0.1 m, y has −2 with 0.2 m.
  const ResidualSummary summary = SummarizeResiduals(residuals, HandMadeResult().residuals);
  ASSERT_EQ(summary.series.size(), 2u);
  const SeriesSummary& x = summary.series[0];
  EXPECT_EQ(x.target, "ball");
  EXPECT_EQ(x.kind, "body");
  EXPECT_EQ(x.file, "a.csv");
  EXPECT_EQ(x.label, "ball x");  // a single file is not told apart
  EXPECT_EQ(x.count, 2);
  EXPECT_DOUBLE_EQ(x.rms_in_sigma, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(x.rms, 0.1 * std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(x.mean, 0.35);
  EXPECT_EQ(x.largest_in_sigma, 4.0);
  EXPECT_EQ(x.largest_time, 1.0);
  EXPECT_DOUBLE_EQ(summary.series[1].mean, -0.4);
  EXPECT_EQ(summary.num_outliers, 0);
}

TEST(ResidualSummaryTest, FilesAndPointsAreSeriesOfTheirOwn) {
  std::vector<Channel> channels(2);
  channels[1].file = 1;
  std::vector<Observation> observations = {{0.1, 0, -1, Coordinate::kX, 0.0, 1.0, 0},
                                           {0.1, 0, 0, Coordinate::kX, 0.0, 1.0, 0},
                                           {0.1, 0, -1, Coordinate::kX, 0.0, 1.0, 1},
                                           {0.2, 0, -1, Coordinate::kX, 0.0, 1.0, 0}};
  const ObservationSeries index = IndexSeries(observations);
  EXPECT_EQ(index.of, (std::vector<int>{0, 1, 2, 0}));
  EXPECT_EQ(index.first, (std::vector<int>{0, 1, 2}));
  RecordingsProblem residuals(
      RolloutResiduals(MakeResiduals(MakeScene(kFallingBall), {{"edge", 0, {0.1, 0.0}}},
                                     {Parameter("gravity/y", -9.0)}, {observations[0]})
                           .scene(),
                       observations, channels));
  residuals.run(0)->SetFiles({"a.csv", "b.csv"});
  const ResidualSummary summary = SummarizeResiduals(residuals, Eigen::Vector4d(1, 2, 3, 4));
  ASSERT_EQ(summary.series.size(), 3u);
  EXPECT_EQ(summary.series[0].label, "ball x (a.csv)");
  EXPECT_EQ(summary.series[1].label, "edge x (a.csv)");
  EXPECT_EQ(summary.series[1].kind, "point");
  EXPECT_EQ(summary.series[2].label, "ball x (b.csv)");
  // Series are told apart in the covariance's autocorrelation too.
  EXPECT_EQ(residuals.Places(0)[2].series, 2);
}

TEST(ResidualSummaryTest, NamesWhatDoesNotBelong) {
  std::vector<Observation> observations;
  Eigen::VectorXd values(200);
  for (int i = 0; i < 200; ++i) {
    observations.push_back(
        {0.005 * i, 0, -1, i % 2 == 0 ? Coordinate::kX : Coordinate::kY, 0.0, 1.0});
    values[i] = (i / 2) % 3 - 1.0;  // −1, 0, 1 of both
  }
  // The median of x is 1, its bound 5 · 1.4826: 8 does not belong, 4 does.
  values[40] = -8.0;
  values[60] = 4.0;
  // All of y are ten times as large: 40 is not large among them, 80 is.
  for (int i = 1; i < 200; i += 2) {
    values[i] *= 10.0;
  }
  values[81] = 40.0;
  values[101] = 80.0;
  const RecordingsProblem residuals(
      MakeResiduals(MakeScene(kFallingBall), {}, {Parameter("gravity/y", -9.0)}, observations));
  const ResidualSummary summary = SummarizeResiduals(residuals, values);
  EXPECT_EQ(summary.num_outliers, 2);
  ASSERT_EQ(summary.outliers.size(), 2u);
  EXPECT_EQ(summary.series[summary.outliers[0].series].label, "ball y");
  EXPECT_EQ(summary.outliers[0].residual, 80.0);
  EXPECT_DOUBLE_EQ(summary.outliers[0].time, 0.505);
  EXPECT_EQ(summary.outliers[1].residual, -8.0);
  EXPECT_EQ(summary.series[0].outliers, 1);
  EXPECT_EQ(summary.series[1].outliers, 1);
}

}  // namespace
}  // namespace tangible
