// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/report.h"

#include <gtest/gtest.h>

#include "../../support/fit_results.h"

namespace tangible {
namespace {

bool Has(const std::string& html, const std::string& part) {
  return html.find(part) != std::string::npos;
}

TEST(ReportTest, ShowsEstimatesIntervalsAndWarnings) {
  const std::string html = FitReport("a <b> & c", HandMadeProblem(), HandMadeResult());
  EXPECT_TRUE(Has(html, "Fit: a &lt;b&gt; &amp; c"));
  EXPECT_FALSE(Has(html, "a <b> & c"));
  for (const char* part : {"gravity/y", "-9.8125", "-11 to -8.625", "robust", "at its lower bound",
                           "0.333333333", "converged", "done &amp; &lt;well&gt;",
                           "<strong>Warning:</strong> a &lt; b", "ball x", "ball y"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
  EXPECT_TRUE(Has(html, "<svg"));
  // One self-contained page.
  EXPECT_FALSE(Has(html, "src=\"http"));
  for (const char* none : {">nan", " nan", ",nan", "\"nan"}) EXPECT_FALSE(Has(html, none)) << none;
}

TEST(ReportTest, ResidualsAreSummedByCoordinate) {
  const std::string html = FitReport("t", HandMadeProblem(), HandMadeResult());
  // x: rms of 3 and 4 is 3.536; y: 2.
  EXPECT_TRUE(Has(html, "3.536"));
}

TEST(ReportTest, PartsThatDoNotApplyAreLeftOut) {
  const RecordingsProblem residuals = HandMadeProblem();
  FitResult result = HandMadeResult();
  std::string html = FitReport("t", residuals, result);
  EXPECT_FALSE(Has(html, "Bias of the step"));
  EXPECT_FALSE(Has(html, "<h2>Starts"));
  const DiscretisationCheck check = HandMadeCheck();
  result.starts.push_back(HandMadeStart({-5.0, 0.2}, 90.0, "not_converged"));
  result.starts[0].tried = "windows";
  result.starts[0].tried_cost = 77.25;
  html = FitReport("t", residuals, result, {.check = &check});
  for (const char* part : {"Bias of the step", "-9.6875", "0.005 s", "<h2>Starts", "(-5, 0.2)",
                           "windows", "77.25", "not_converged", "<h2>Correlation"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
}

TEST(ReportTest, ManyObservationsAreThinned) {
  constexpr int kMany = 100000;
  std::vector<Observation> observations;
  FitResult result = HandMadeResult();
  result.residuals.resize(kMany);
  for (int i = 0; i < kMany; ++i) {
    observations.push_back({i / double{kMany}, 0, -1, Coordinate::kX, std::sin(i), 0.1});
    result.residuals[i] = std::cos(i);
  }
  result.residuals[777] = -123.25;
  const RecordingsProblem residuals(MakeResiduals(
      MakeScene(kFallingBall), {},
      {Parameter("gravity/y", -9.0), Parameter("bodies/ball/linear_damping", 0.1)}, observations));
  const std::string html = FitReport("t", residuals, result);
  EXPECT_LT(html.size(), 300000u);
  for (const char* part : {"plots are thinned", "100000", "Outliers", "-123.2", "0.00777"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
  EXPECT_FALSE(Has(FitReport("t", HandMadeProblem(), HandMadeResult()), "thinned"));
}

TEST(ReportTest, TheErrorOfPredictionsIsDrawnByHorizon) {
  PredictedRecordings later;
  PredictionScore& score = later.score;
  score.from = 2.5;
  score.all = {0.0, 1.0, 6, 1.5, 0.01, 0.02, NAN, NAN};
  score.horizons = {{0.0, 0.5, 3, 1.0, 0.005, 0.0125, NAN, NAN},
                    {0.5, 1.0, 3, 2.0, 0.015, 0.02, NAN, NAN}};
  std::string html = FitReport("t", HandMadeProblem(), HandMadeResult(), {.later = &later});
  for (const char* part : {"<h2>Prediction", "up to 2.5 s", "error of predictions", "0.0125"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
  EXPECT_FALSE(Has(html, ">rad<"));
  score.message = "the ball <diverges>";
  html = FitReport("t", HandMadeProblem(), HandMadeResult(), {.later = &later});
  EXPECT_TRUE(Has(html, "the ball &lt;diverges&gt;"));
  EXPECT_FALSE(Has(html, "error of predictions"));
}

}  // namespace
}  // namespace tangible
