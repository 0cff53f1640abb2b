// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/corpus_report.h"

#include <gtest/gtest.h>

namespace tangible::corpus {
namespace {

CorpusResult Result() {
  Row row{.kind = "stack",
          .known = Known::kSolvable,
          .way = Way::kMisled,
          .problems = 12,
          .right = 11,
          .wrong = 0,
          .residual_max = 3e-12,
          .seconds_median = 2e-3,
          .seconds_max = 0.25};
  row.solvers = {{"guess", 8}, {"lemke", 4}};
  row.missed = {"stack 7"};
  return {{row}, 12};
}

TEST(CorpusReportTest, TheTableHasALineAKindAndNamesWhatIsMissed) {
  const std::string text = TableText(Result());
  EXPECT_NE(
      text.find("stack                misled         12     11      0     3e-12   2.00 ms    250 ms"
                "  guess 8, lemke 4\n"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("not right, stack, misled: stack 7\n"), std::string::npos) << text;
  EXPECT_NE(text.find("12 problems, 12 answers: 11 right, 0 wrong, 1 not found\n"),
            std::string::npos);
}

TEST(CorpusReportTest, JsonHasTheFigures) {
  const OrderedJson json = ToJson(Result());
  EXPECT_EQ(json["problems"], 12);
  const OrderedJson& row = json["rows"][0];
  EXPECT_EQ(row["kind"], "stack");
  EXPECT_EQ(row["known"], "solvable");
  EXPECT_EQ(row["way"], "misled");
  EXPECT_EQ(row["right"], 11);
  EXPECT_EQ(row["solver"]["lemke"], 4);
  EXPECT_EQ(row["missed"][0], "stack 7");
  EXPECT_EQ(row["seconds_max"], 0.25);
}

}  // namespace
}  // namespace tangible::corpus
