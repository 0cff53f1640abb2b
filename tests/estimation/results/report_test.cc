// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/report.h"

#include <gtest/gtest.h>

#include "../../support/fit_results.h"

namespace tangible {
namespace {

bool Has(const std::string& html, const std::string& part) {
  return html.find(part) != std::string::npos;
}

TEST(ReportTest, TellsEstimatesIntervalsAndWarnings) {
  const std::string html = FitReport("a <b> & c", HandMadeResiduals(), HandMadeResult(), nullptr);
  EXPECT_TRUE(Has(html, "Fit: a &lt;b&gt; &amp; c"));
  EXPECT_FALSE(Has(html, "a <b> & c"));
  for (const char* part : {"gravity/y", "-9.8125", "-10.3125", "-9.3125", "at its lower bound",
                           "0.333333333", "converged", "done &amp; &lt;well&gt;",
                           "<strong>Warning:</strong> a &lt; b", "ball x", "ball y"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
  EXPECT_TRUE(Has(html, "<svg"));
  // One self-contained page.
  EXPECT_FALSE(Has(html, "src=\"http"));
  EXPECT_FALSE(Has(html, "nan"));
}

TEST(ReportTest, ResidualsAreSummedByCoordinate) {
  const std::string html = FitReport("t", HandMadeResiduals(), HandMadeResult(), nullptr);
  // x: rms of 3 and 4 is 3.536; y: 2.
  EXPECT_TRUE(Has(html, "3.536"));
}

TEST(ReportTest, PartsThatDoNotApplyAreLeftOut) {
  const RolloutResiduals residuals = HandMadeResiduals();
  FitResult result = HandMadeResult();
  std::string html = FitReport("t", residuals, result, nullptr);
  EXPECT_FALSE(Has(html, "Bias of the step"));
  EXPECT_FALSE(Has(html, "<h2>Starts"));
  const DiscretisationCheck check = HandMadeCheck();
  result.starts.push_back({{-5.0, 0.2}, 90.0, 4, 0, "not_converged"});
  html = FitReport("t", residuals, result, &check);
  for (const char* part : {"Bias of the step", "-9.6875", "0.005 s", "<h2>Starts", "(-5, 0.2)",
                           "not_converged", "<h2>Correlation"}) {
    EXPECT_TRUE(Has(html, part)) << part;
  }
}

}  // namespace
}  // namespace tangible
