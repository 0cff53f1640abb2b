// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

TEST(VerifyTextTest, ErrorsAreShort) {
  EXPECT_EQ(ErrorText(0.0), "0");
  EXPECT_EQ(ErrorText(1.23e-11), "1.2e-11");
  EXPECT_EQ(ErrorText(NAN), "-");
  EXPECT_EQ(ErrorText(HUGE_VAL), "none");
}

TEST(VerifyTextTest, ARowASceneAndKindAndPairsThatWereCompared) {
  VerifyResult result;
  SceneCheck scene;
  scene.name = "one";
  scene.done = true;
  KindRow row;
  row.kind = "bodies/mass";
  row.parameters = 1;
  row.entries = 6;
  row.error[0] = 2e-12;
  row.zero_columns = {"bodies/a/mass"};
  scene.rows = {row};
  scene.total.Add(row);
  CheckedException exception;
  exception.parameter = "bodies/a/mass";
  exception.what = "seen";
  scene.exceptions = {exception};
  result.scenes = {scene, SceneCheck()};
  result.scenes[1].name = "two";
  result.scenes[1].message = "unsolved";
  result.total.Add(row);
  EXPECT_EQ(PairsShown(result), std::vector<int>{0});
  const std::string table = TableText(result);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  EXPECT_NE(table.find("one   bodies/mass"), std::string::npos) << table;
  EXPECT_NE(table.find("2.0e-12"), std::string::npos) << table;
  EXPECT_NE(table.find("two   not run: unsolved"), std::string::npos) << table;
  EXPECT_EQ(table.find("Ridders"), std::string::npos) << table;
  const std::string summary = SummaryText(result, true);
  for (const char* part : {"UNEXPLAINED one, bodies/a/mass, adjoint",
                           "nothing depends\none: bodies", "not covered: joint weld"}) {
    EXPECT_NE(summary.find(part), std::string::npos) << part << "\n" << summary;
  }
}

}  // namespace
}  // namespace tangible
