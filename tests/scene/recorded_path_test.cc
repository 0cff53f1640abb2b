// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/recorded_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/validate.h"

namespace tangible {
namespace {

PathSeries Wave(PathInterpolation interpolation) {
  PathSeries series;
  series.interpolation = interpolation;
  series.time = {0.0, 0.4, 1.0, 1.3, 2.0};
  for (const double t : series.time) series.x.push_back(std::sin(3.0 * t));
  return series;
}

TEST(RecordedPathTest, ACubicIsReproducedWithItsDerivatives) {
  PathSeries series;
  series.time = {-1.0, 0.3, 0.5, 2.0};
  for (const double t : series.time) series.angle.push_back(1.0 + t - 2.0 * t * t + t * t * t);
  const RecordedPath path(series);
  EXPECT_FALSE(path.Has(0));
  EXPECT_TRUE(path.Has(2));
  for (const double t : {-0.7, 0.3, 0.45, 1.7}) {
    const RecordedPath::Point p = path.At(2, t, t);
    EXPECT_NEAR(p.value, 1.0 + t - 2.0 * t * t + t * t * t, 1e-14);
    EXPECT_NEAR(p.rate, 1.0 - 4.0 * t + 3.0 * t * t, 1e-13);
    EXPECT_NEAR(p.acceleration, -4.0 + 6.0 * t, 1e-12);
    EXPECT_NEAR(p.jerk, 6.0, 1e-11);
  }
}

TEST(RecordedPathTest, LinearPathsJumpAtKnotsAndTheEndsAreHeld) {
  PathSeries series;
  series.interpolation = PathInterpolation::kLinear;
  series.time = {0.0, 1.0, 3.0};
  series.x = {1.0, 2.0, -2.0};
  const RecordedPath path(series);
  EXPECT_EQ(path.At(0, 0.5, 0.5).value, 1.5);
  EXPECT_EQ(path.At(0, 1.0, 0.9).rate, 1.0);
  EXPECT_EQ(path.At(0, 1.0, 1.0).rate, -2.0);
  EXPECT_EQ(path.At(0, 1.0, 1.1).rate, -2.0);
  // A piece may be evaluated beyond its ends.
  EXPECT_EQ(path.At(0, 1.5, 0.5).value, 2.5);
  for (const double t : {-5.0, 0.0}) EXPECT_EQ(path.At(0, t, -1e-9).value, 1.0);
  EXPECT_EQ(path.At(0, -5.0, -5.0).rate, 0.0);
  EXPECT_EQ(path.At(0, 7.0, 7.0).value, -2.0);
  EXPECT_EQ(path.At(0, 7.0, 7.0).rate, 0.0);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(path.JumpsAt(k));
  // Held at first and in the end, and on a straight line between: only two knots are corners.
  series.time = {0.0, 0.2, 0.7, 1.2, 2.0};
  series.x = {-0.3, -0.3, -0.05, 0.2, 0.2};
  const RecordedPath straight(series);
  for (int k = 0; k < 5; ++k) EXPECT_EQ(straight.JumpsAt(k), k == 1 || k == 3) << k;
  const RecordedPath cubic(Wave(PathInterpolation::kCubic));
  for (int k = 0; k < 5; ++k) EXPECT_EQ(cubic.JumpsAt(k), k == 0 || k == 4);
}

TEST(RecordedPathTest, NoRateExceedsItsBound) {
  for (const PathInterpolation interpolation :
       {PathInterpolation::kCubic, PathInterpolation::kLinear}) {
    const RecordedPath path(Wave(interpolation));
    for (const auto& [from, to] :
         {std::pair(-1.0, 3.0), std::pair(0.1, 0.2), std::pair(0.3, 1.7)}) {
      double largest = 0.0;
      for (int k = 0; k <= 1000; ++k) {
        const double t = from + (to - from) * k / 1000.0;
        largest = std::max(largest, std::abs(path.At(0, t, t).rate));
      }
      const double bound = path.LargestRate(0, from, to);
      EXPECT_GE(bound, largest);
      EXPECT_LT(bound, 2.0 * largest + 1e-12);
    }
    EXPECT_EQ(path.LargestRate(0, 2.5, 3.0), 0.0);
  }
}

class PathFileTest : public ::testing::Test {
 protected:
  std::string ErrorOf(const std::string& text) {
    const std::string file = ::testing::TempDir() + "tangible_path_test.csv";
    std::ofstream(file) << text;
    std::string error;
    series_ = PathSeries();
    if (ReadPath(file, &series_, &error)) return "";
    EXPECT_EQ(error.rfind(file + ": ", 0), 0u) << error;
    return error.substr(file.size() + 2);
  }
  PathSeries series_;
};

TEST_F(PathFileTest, Columns) {
  EXPECT_EQ(ErrorOf("time,angle,x\n0,1,2\n0.5,3,4\n"), "");
  EXPECT_EQ(series_.x, (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(series_.angle, (std::vector<double>{1.0, 3.0}));
  EXPECT_TRUE(series_.y.empty());
  EXPECT_EQ(ErrorOf("time\n0\n"), "line 1: missing columns, expected x, y or angle beside time");
  EXPECT_EQ(ErrorOf("time,x\n"), "line 2: expected at least one row, got none");
  EXPECT_EQ(ErrorOf("time,x\n0,1\n0.5,2\n0.5,3\n"),
            "line 4: time: expected a number > 0.5 (the time before), got 0.5");
  EXPECT_EQ(ErrorOf("time,x\n0,1\n0.5,\n"), "line 3: x: expected a number, got \"\"");
}

constexpr char kHand[] = R"({"bodies": [
  {"name": "hand", "kinematic": true, "angle": 0.5, "motion": {"file": "hand.csv", "delay": 0.25,
   "scale": 2, "offset": [0.5, 1], "interpolation": "linear"}}]})";

class DrivenSceneTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(::testing::TempDir() + "hand.csv") << "time,x,y\n0,1,2\n1,3,4\n2,0,0\n";
  }
  // "" or the error of the scene with one change.
  std::string Read(const std::string& pointer = "", const std::string& value = "") {
    Json json = Json::parse(kHand);
    if (!pointer.empty()) json[Json::json_pointer(pointer)] = Json::parse(value);
    std::string error;
    ParseScene(json.dump(), "s.json", ::testing::TempDir(), &scene_, &error);
    return error;
  }
  Scene scene_;
};

TEST_F(DrivenSceneTest, IsReadWrittenAndNamed) {
  ASSERT_EQ(Read(), "");
  ASSERT_TRUE(scene_.bodies[0].driven.has_value());
  const auto& driven = *scene_.bodies[0].driven;
  EXPECT_EQ(driven.path->series().interpolation, PathInterpolation::kLinear);
  EXPECT_EQ(driven.path->times(), (std::vector<double>{0.0, 1.0, 2.0}));
  EXPECT_EQ(driven.delay, 0.25);
  EXPECT_EQ(driven.scale, 2.0);
  EXPECT_EQ(driven.offset, Vector2<double>(0.5, 1.0));
  std::vector<std::string> paths;
  for (const auto& number : EnumerateNumbers(&scene_)) paths.push_back(number.path);
  for (const char* path : {"delay", "scale", "offset/x", "offset/y", "offset_angle"}) {
    EXPECT_EQ(std::count(paths.begin(), paths.end(), std::string("bodies/hand/motion/") + path), 1)
        << path;
  }
  EXPECT_EQ(std::count(paths.begin(), paths.end(), "bodies/hand/velocity/x"), 0);
  EXPECT_EQ(Validate(scene_, "s"), "");
  for (const std::string& text : {SceneToJson(scene_), SceneWithSignalsToJson(scene_)}) {
    Scene again;
    std::string error;
    ASSERT_TRUE(ParseScene(text, "again.json", ::testing::TempDir(), &again, &error)) << error;
    EXPECT_EQ(again.bodies[0].driven->path->series().y, driven.path->series().y);
    EXPECT_EQ(again.bodies[0].driven->offset, driven.offset);
    EXPECT_EQ(SceneWithSignalsToJson(again), SceneWithSignalsToJson(scene_));
  }
  const auto jets = CastScene<LocalJet>(scene_);
  EXPECT_EQ(jets.bodies[0].driven->path, driven.path);
  EXPECT_EQ(jets.bodies[0].driven->scale.a, 2.0);
}

TEST_F(DrivenSceneTest, ASeriesMayStandInTheScene) {
  EXPECT_EQ(Read("/bodies/0/motion", R"({"time": [0, 1, 2], "angle": [0, 1, 4]})"), "");
  EXPECT_EQ(scene_.bodies[0].driven->path->series().interpolation, PathInterpolation::kCubic);
  EXPECT_NEAR(scene_.bodies[0].driven->path->At(2, 1.5, 1.5).value, 2.25, 1e-15);
}

TEST_F(DrivenSceneTest, BadInputGivesOneLine) {
  const std::string at = "s.json: /bodies/0";
  EXPECT_EQ(Read("/bodies/0", R"({"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
                                  "motion": {"time": [0], "x": [1]}})"),
            at + "/kinematic: missing, expected true with motion");
  EXPECT_EQ(Read("/bodies/0/velocity", "[0, 0]"),
            at + "/velocity: expected no velocity beside motion, which gives it");
  EXPECT_EQ(Read("/bodies/0/angular_velocity", "1"),
            at + "/angular_velocity: expected no angular_velocity beside motion, which gives it");
  EXPECT_EQ(Read("/bodies/0/motion/offset_angle", "0.1"),
            at + "/motion/offset_angle: expected 0, for the path has no column angle (its angle is "
                 "that of the body), got 0.1");
  EXPECT_EQ(Read("/bodies/0/motion/speed", "1"),
            at + "/motion/speed: unknown key of a motion, expected one of file, interpolation, "
                 "time, x, y, angle, delay, scale, offset, offset_angle, got \"speed\"");
  EXPECT_EQ(Read("/bodies/0/motion/time", "[0, 1]"),
            at + "/motion/time: expected no time beside file, which has the times");
  EXPECT_EQ(Read("/bodies/0/motion/x", "[0, 1]"),
            at + "/motion/x: expected time beside it, or file alone");
  EXPECT_EQ(Read("/bodies/0/motion", R"({"delay": 1})"),
            at + "/motion/file: missing, expected a string");
  EXPECT_EQ(Read("/bodies/0/motion", R"({"time": [0, 0], "x": [1, 2]})"),
            at + "/motion/time/1: expected a number > 0.0 (the time before), got 0");
  EXPECT_EQ(Read("/bodies/0/motion", R"({"time": [0, 1]})"),
            at + "/motion: missing x, y or angle beside time");
  EXPECT_EQ(Read("/bodies/0/motion/interpolation", R"("spline")"),
            at + "/motion/interpolation: expected one of linear, cubic, got \"spline\"");
  const std::string missing = Read("/bodies/0/motion/file", R"("none.csv")");
  EXPECT_NE(missing.find("none.csv"), std::string::npos) << missing;
  EXPECT_EQ(missing.find('\n'), std::string::npos);
}

TEST_F(DrivenSceneTest, ScenesInMemoryAreChecked) {
  ASSERT_EQ(Read(), "");
  Scene bad = scene_;
  bad.bodies[0].velocity = {1.0, 0.0};
  EXPECT_EQ(Validate(bad, "s"),
            "s: /bodies/0/motion: expected no velocity or angular_velocity beside motion, which "
            "gives them");
  bad = scene_;
  bad.bodies[0].motion = Motion::kStatic;
  EXPECT_EQ(Validate(bad, "s"),
            "s: /bodies/0/motion: expected a kinematic body, got one that is not");
  bad = scene_;
  bad.bodies[0].driven->path = nullptr;
  EXPECT_EQ(Validate(bad, "s"), "s: /bodies/0/motion/file: missing, expected the file of a path");
}

}  // namespace
}  // namespace tangible
