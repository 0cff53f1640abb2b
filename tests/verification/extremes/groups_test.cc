// SPDX-License-Identifier: Apache-2.0
//
// Every group has a case that runs in this process and holds; the table of all is the program's.

#include "tangible/verification/extremes/groups.h"

#include <gtest/gtest.h>

namespace tangible::extremes {
namespace {

struct GroupCase {
  void (*add)(std::vector<ExtremeCase>*);
  const char* name;
};

class GroupsTest : public ::testing::TestWithParam<GroupCase> {};

TEST_P(GroupsTest, ACheapCaseHolds) {
  std::vector<ExtremeCase> cases;
  GetParam().add(&cases);
  int found = 0;
  for (const ExtremeCase& one : cases) {
    if (one.name != GetParam().name) continue;
    ++found;
    const Finding finding = one.run(Length::kShort);
    EXPECT_FALSE(finding.figures.empty());
    for (const Figure& figure : finding.figures) {
      EXPECT_TRUE(figure.holds()) << one.stepping << ": " << figure.what << " " << figure.value;
    }
    EXPECT_TRUE(finding.gradient.holds()) << one.stepping << finding.gradient.message;
  }
  EXPECT_EQ(found, 2);  // both steppings
}

INSTANTIATE_TEST_SUITE_P(
    Groups, GroupsTest,
    ::testing::Values(GroupCase{&AddMassRatios, "box 1 on box 1e3"},
                      GroupCase{&AddResting, "two cards"}, GroupCase{&AddScales, "gravity 0"},
                      GroupCase{&AddSpeeds, "two discs at 1e4 m/s"},
                      GroupCase{&AddGeometry, "discs with one centre"},
                      GroupCase{&AddFriction, "slope of 40 degrees, mu 1e+12"},
                      GroupCase{&AddRestitution, "cradle of 3 that touch"},
                      GroupCase{&AddParadoxes, "Painleve, inconsistent, h 1e-6"},
                      GroupCase{&AddJoints, "welded loop falls"},
                      GroupCase{&AddLongRuns, "flywheels at 1e4 rad/s on a bar"},
                      GroupCase{&AddOptimiser, "ball of 1e+12 kg"}));

}  // namespace
}  // namespace tangible::extremes
