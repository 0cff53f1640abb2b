// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/observation.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

const std::vector<BodyPoint> kTip = {{"tip", 0, {0.5, 0.0}}};

struct Parsed {
  bool ok = false;
  std::string error;
  std::vector<Observation> observations;
};

Parsed Parse(const std::string& text) {
  Parsed parsed;
  parsed.ok = ParseObservations(text, "o.csv", MakeScene(kFallingBall), kTip, {0.1, 0.2, 0.3},
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
      {"time,body\n0,ball\n",
       "o.csv: header: expected a column x, y, angle, vx, vy, omega, distance, ax, ay or alpha, "
       "got none of them"},
      {"time,x\n0,1\n",
       "o.csv: header: expected one column body, point, joint or contact, got none"},
      {"time,body,point,x\n0,ball,tip,1\n",
       "o.csv: header: expected one column body, point, joint or contact, got several"}};
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

/// Reads with an encoder of 0.25 s delay on a clock that runs twice as fast as the run.
struct Recorded : Parsed {
  std::vector<Channel> channels;
};

Recorded ParseRecorded(const std::string& text, const ObservationOptions& options) {
  Recorded parsed;
  const Scene scene = MakeScene(kFallingBall);
  Instruments instruments;
  instruments.sensors = {{"encoder", 0.25}};
  instruments.clocks = {{"fast", 0.5, 0.25}};
  parsed.ok = ParseObservations(text, "o.csv", ObservedScene{scene, kTip, instruments}, {}, options,
                                &parsed.channels, &parsed.observations, &parsed.error);
  return parsed;
}

TEST(ObservationTest, VelocitiesAndDistances) {
  const Recorded parsed = ParseRecorded(
      "time,body,relative_to,vx,omega,distance\n0,ball,,1,2,\n0.5,ball,tip,3,,4\n0.6,ball,tip,,,"
      "5\n",
      {});
  ASSERT_TRUE(parsed.ok) << parsed.error;
  ASSERT_EQ(parsed.observations.size(), 5u);
  EXPECT_EQ(parsed.observations[0].coordinate, Coordinate::kVx);
  EXPECT_EQ(parsed.observations[1].coordinate, Coordinate::kOmega);
  EXPECT_EQ(parsed.observations[3].coordinate, Coordinate::kDistance);
  ASSERT_EQ(parsed.channels.size(), 2u);  // one for each reference
  EXPECT_EQ(parsed.observations[0].channel, 0);
  EXPECT_EQ(parsed.observations[4].channel, 1);
  EXPECT_EQ(parsed.channels[1].to_body, 0);
  EXPECT_EQ(parsed.channels[1].to_point, 0);
  EXPECT_EQ(ParseRecorded("time,body,distance\n0,ball,1\n", {}).error,
            "o.csv: line 2: distance: expected relative_to to name a body or point, got the world");
  EXPECT_EQ(ParseRecorded("time,body,relative_to,x\n0,ball,bal,1\n", {}).error,
            "o.csv: line 2: relative_to: expected the name of a body (ball) or point (tip), got "
            "\"bal\"");
}

TEST(ObservationTest, TimesAreThoseOfTheClock) {
  ObservationOptions options;
  options.channel.sensor = 0;
  options.channel.clock = 0;
  const Recorded parsed = ParseRecorded("time,body,x\n0,ball,1\n2,ball,1\n", options);
  ASSERT_TRUE(parsed.ok) << parsed.error;
  EXPECT_EQ(parsed.observations[1].time, 2.0);
  EXPECT_EQ(parsed.channels[0].sensor, 0);
  EXPECT_EQ(ParseRecorded("time,body,x\n2.5,ball,1\n", options).error,
            "o.csv: line 2: time: expected a time within the run, [0, 1] s, got 2.5, which is 1.25 "
            "of the run by clock and delay");
}

TEST(ObservationTest, AnglesAreUnwrappedAcrossGaps) {
  // 9 rad/s, read modulo a turn, not in the order of time; nothing was read for two turns.
  std::string text = "time,body,angle\n";
  std::vector<double> times;
  for (int k = 0; k <= 90; ++k) {
    if (k < 20 || k > 80) {
      times.push_back(0.01 * ((k * 37) % 91));
    }
  }
  for (const double time : times) {
    text += std::to_string(time) + ",ball," +
            std::to_string(std::remainder(9.0 * time + 3.0, 2.0 * M_PI)) + "\n";
  }
  ObservationOptions options;
  options.unwrap = true;
  const Recorded parsed = ParseRecorded(text, options);
  ASSERT_TRUE(parsed.ok) << parsed.error;
  double turns = 0.0;
  for (size_t i = 0; i < times.size(); ++i) {
    const Observation& observation = parsed.observations[i];
    const double left = observation.value - (9.0 * observation.time + 3.0);
    turns = i == 0 ? left : turns;
    EXPECT_NEAR(left, turns, 1e-5) << observation.time;
  }
  options.unwrap = false;
  const Recorded wrapped = ParseRecorded(text, options);
  EXPECT_LE(std::abs(wrapped.observations[3].value), M_PI);
}

}  // namespace
}  // namespace tangible
