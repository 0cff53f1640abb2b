// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

namespace tangible {
namespace {

TEST(NoiseFromFourthDifferencesTest, FindsTheNoiseOnASmoothMotion) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<double> values;
  values.reserve(4000);
  for (int k = 0; k < 4000; ++k) {
    values.push_back(5.0 * std::sin(0.01 * k) + noise(random));
  }
  // The estimate's own relative deviation is about sqrt(1.1 / 4000) = 1.7 %: fourth differences of
  // neighbours are correlated.
  EXPECT_NEAR(NoiseFromFourthDifferences(values), 0.02, 0.02 * 0.07);
}

TEST(NoiseFromFourthDifferencesTest, IsNothingOnACubic) {
  std::vector<double> values;
  values.reserve(20);
  for (int k = 0; k < 20; ++k) {
    values.push_back(1.0 + k - 2.0 * k * k + 0.5 * k * k * k);
  }
  EXPECT_EQ(NoiseFromFourthDifferences(values), 0.0);
  values.resize(4);
  EXPECT_TRUE(std::isnan(NoiseFromFourthDifferences(values)));
}

// The camera moves by (10 k, −7 k) fifths of a pixel; the joint hangs 500 below the pivot, the tip
// 300 to the right of the joint.
std::string MarkerFile(int frames) {
  std::ostringstream text;
  for (int k = 0; k < frames; ++k) {
    const int down = 1000 - 7 * k;
    const int right = 2000 + 10 * k;
    text << down << "," << right << "," << down + 500 << "," << right << "," << down + 500 << ","
         << right + 300 << "\n";
  }
  return text.str();
}

TEST(RecordingTest, MarkersAreRelativeToThePivotInMetres) {
  RecordingOptions options;
  options.from = 0.0025;
  options.to = 0.02;
  options.first_length = 0.1;
  Recording recording;
  std::string error;
  ASSERT_TRUE(ParseRecording(MarkerFile(20), "m.csv", options, &recording, &error)) << error;
  EXPECT_EQ(recording.times.size(), 8u);
  EXPECT_EQ(recording.times.front(), 0.0);
  EXPECT_NEAR(recording.times.back(), 0.0175, 1e-15);
  EXPECT_NEAR(recording.metres_per_pixel, 0.1 / 100.0, 1e-15);
  EXPECT_NEAR(recording.length_ratio, 5.0 / 3.0, 1e-14);
  EXPECT_NEAR(recording.noise, 0.0, 1e-15);
  ASSERT_EQ(recording.series.size(), 4u);
  const std::string csv = ObservationCsv(recording);
  EXPECT_EQ(csv.substr(0, csv.find("0.0025")),
            "time,point,x,y\n0,joint,0,-0.1\n0,tip,0.060000000000000005,-0.1\n");
}

TEST(RecordingTest, AnglesAreMeasuredFromHanging) {
  std::string text = "t,th1,om1\n";
  for (int k = 0; k < 6; ++k) {
    text += std::to_string(0.005 * k) + "," + std::to_string(3.0 + 0.1 * k) + ",0\n";
  }
  RecordingOptions options;
  options.kind = RecordingKind::kMultiarmSingle;
  Recording recording;
  std::string error;
  ASSERT_TRUE(ParseRecording(text, "a.csv", options, &recording, &error)) << error;
  EXPECT_EQ(recording.series[0].values.size(), 6u);
  EXPECT_NEAR(recording.series[0].values[1], 3.1 - std::numbers::pi, 1e-14);
  EXPECT_EQ(recording.metres_per_pixel, 0.0);
  EXPECT_EQ(ObservationCsv(recording).substr(0, 16), "time,body,angle\n");
}

TEST(RecordingTest, SaysWhatIsWrong) {
  RecordingOptions options;
  Recording recording;
  std::string error;
  EXPECT_FALSE(ParseRecording(MarkerFile(4), "m.csv", options, &recording, &error));
  EXPECT_NE(error.find("m.csv: expected at least 5 rows"), std::string::npos) << error;
  EXPECT_FALSE(ParseRecording("1,2,3,4,5,6\n1,2,x,4,5,6\n", "m.csv", options, &recording, &error));
  EXPECT_NE(error.find("m.csv: line 2"), std::string::npos) << error;
  EXPECT_FALSE(ParseRecording("1,2,1,2,5,6\n", "m.csv", options, &recording, &error));
  EXPECT_NE(error.find("apart"), std::string::npos) << error;
  EXPECT_FALSE(ReadRecording("/nonexistent.csv", options, &recording, &error));
}

TEST(RecordingTest, NumbersKeepTheirDigitsAndMistakesAreOneLine) {
  RecordingOptions options;
  options.kind = RecordingKind::kMultiarmSingle;
  options.to = 1.0;
  const auto parse = [&](const std::string& last, Recording* recording) {
    std::string error;
    std::string text = "t,th1,om1\n";
    for (const char* time : {"0.1", "0.2000000000001", "0.3", "0.4"}) {
      text += std::string(time) + ",3.00000000000001,0\n";
    }
    ParseRecording(text + last, "a.csv", options, recording, &error);
    return error;
  };
  Recording recording;
  ASSERT_EQ(parse("0.5,0,0\n", &recording), "");
  const std::string csv = ObservationCsv(recording);
  EXPECT_NE(csv.find("\n0.2000000000001,pendulum,-0.14159265358978"), std::string::npos) << csv;
  EXPECT_EQ(parse("0.4,0,0\n", &recording),
            "a.csv: line 6: t: expected one after 0.4 s, got 0.4: the clock stands still or runs "
            "backwards");
  options.kind = RecordingKind::kIbmDoublePendulum;
  options.first_length = 1e308;
  std::string error;
  EXPECT_FALSE(
      ParseRecording(MarkerFile(20) + "0,0,0,0,0,100000\n", "m.csv", options, &recording, &error));
  EXPECT_NE(error.find("m.csv: expected coordinates of tip that a double can hold"),
            std::string::npos)
      << error;
}

}  // namespace
}  // namespace tangible
