// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/observation.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

const std::vector<BodyPoint> kPoints = {{"tip", 0, {0.5, 0.0}}};

struct Parsed {
  bool ok = false;
  std::string error;
  std::vector<Observation> observations;
};

Parsed Parse(const std::string& text) {
  Parsed parsed;
  parsed.ok = ParseObservations(text, "o.csv", MakeScene(kFallingBall), kPoints, {0.1, 0.2, 0.3},
                                &parsed.observations, &parsed.error);
  return parsed;
}

TEST(ObservationTest, EmptyCellsAndColumnsAreMissing) {
  const Parsed parsed = Parse("time,body,y,angle\n0.5,ball,2,\n0.25,ball,,3\n0.5,ball,2.5,\n");
  ASSERT_TRUE(parsed.ok) << parsed.error;
  ASSERT_EQ(parsed.observations.size(), 3u);
  EXPECT_EQ(parsed.observations[0].coordinate, Coordinate::kY);
  EXPECT_EQ(parsed.observations[0].value, 2.0);
  EXPECT_EQ(parsed.observations[0].sigma, 0.2);
  EXPECT_EQ(parsed.observations[0].point, -1);
  EXPECT_EQ(parsed.observations[1].coordinate, Coordinate::kAngle);
  EXPECT_EQ(parsed.observations[1].sigma, 0.3);
  EXPECT_EQ(parsed.observations[1].time, 0.25);
  EXPECT_EQ(parsed.observations[2].value, 2.5);
}

TEST(ObservationTest, PointsByName) {
  const Parsed parsed = Parse("point,time,x\ntip,1,7\n");
  ASSERT_TRUE(parsed.ok) << parsed.error;
  ASSERT_EQ(parsed.observations.size(), 1u);
  EXPECT_EQ(parsed.observations[0].point, 0);
  EXPECT_EQ(parsed.observations[0].body, 0);
  EXPECT_EQ(parsed.observations[0].sigma, 0.1);
}

TEST(ObservationTest, MistakesAreOneLineWithFileAndLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"time,body,x\n0,ball,1\n0.1,bal,1\n",
       "o.csv: line 3: body: expected the name of a body (ball), got \"bal\""},
      {"time,point,x\n0,tap,1\n",
       "o.csv: line 2: point: expected the name of a point (tip), got \"tap\""},
      {"time,body,x\n1.01,ball,1\n",
       "o.csv: line 2: time: expected a time within the run, [0, 1] s, got 1.01"},
      {"time,body,x\n-0.1,ball,1\n",
       "o.csv: line 2: time: expected a time within the run, [0, 1] s, got -0.1"},
      {"time,body,x\n0,ball,\n", "o.csv: expected at least one measured coordinate, got none"},
      {"time,body,x\n", "o.csv: expected at least one measured coordinate, got none"},
      {"time,body\n0,ball\n", "o.csv: header: expected a column x, y or angle, got none of them"},
      {"time,x\n0,1\n", "o.csv: header: expected a column body or a column point, got neither"},
      {"time,body,point,x\n0,ball,tip,1\n",
       "o.csv: header: expected a column body or a column point, got both"}};
  for (const auto& [text, message] : cases) {
    const Parsed parsed = Parse(text);
    EXPECT_FALSE(parsed.ok) << text;
    EXPECT_EQ(parsed.error, message);
  }
  for (const char* text :
       {"", "time,body,x\n0,ball,nan\n", "time,body,x\nx,ball,1\n", "time,body,z\n0,ball,1\n",
        "time,body,x\n0,ball\n", "body,x\nball,1\n"}) {
    const Parsed parsed = Parse(text);
    EXPECT_FALSE(parsed.ok) << text;
    EXPECT_EQ(parsed.error.find("o.csv"), 0u) << parsed.error;
    EXPECT_EQ(parsed.error.find('\n'), std::string::npos) << parsed.error;
  }
}

}  // namespace
}  // namespace tangible
