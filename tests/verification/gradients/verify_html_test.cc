// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_html.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/verification/gradients/verify_text.h"

namespace tangible {
namespace {

TEST(VerifyHtmlTest, HeatIsLogarithmicInTheBound) {
  EXPECT_EQ(HeatOf(0.0), 0.0);
  EXPECT_EQ(HeatOf(1e-9), 0.0);
  EXPECT_DOUBLE_EQ(HeatOf(1e-4), 0.5);
  EXPECT_EQ(HeatOf(1.0), 1.0);
  EXPECT_EQ(HeatOf(HUGE_VAL), 1.0);
  EXPECT_EQ(HeatOf(NAN), 0.0);
}

TEST(VerifyHtmlTest, ThePageHasACellASceneAndPairAndNoOtherFile) {
  const std::vector<VerifyJob> jobs = RandomJobs(RandomList::kScenes, 1, 3, {Stepping::kFixed});
  VerifyResult result = RunVerification(jobs, 1, KeepJacobians::kNo, {});
  const auto cells = [](const std::string& page) {
    size_t count = 0;
    for (size_t at = page.find("<rect"); at != std::string::npos; at = page.find("<rect", at + 1)) {
      ++count;
    }
    return count;
  };
  const std::string page = VerifyReport(result, "made <here>", "");
  EXPECT_GE(cells(page), 3 * PairsShown(result).size());
  EXPECT_NE(page.find("Every bound holds."), std::string::npos);
  EXPECT_NE(page.find("made &lt;here&gt;"), std::string::npos);
  EXPECT_NE(page.find("tangible-verify --random=1 --seed="), std::string::npos);
  for (const char* outside : {"http://", "https://", "src="}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  // An unexplained exception is seen.
  EXPECT_EQ(page.find("unexplained: 7"), std::string::npos);
  CheckedException exception;
  exception.entries = 7;
  exception.parameter = "bodies/a/mass";
  result.scenes[0].exceptions.push_back(exception);
  const std::string broken = VerifyReport(result, "", "7 unexplained entries");
  EXPECT_NE(broken.find("unexplained: 7"), std::string::npos);
  EXPECT_NE(broken.find("7 unexplained entries"), std::string::npos);
}

}  // namespace
}  // namespace tangible
