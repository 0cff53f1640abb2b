// SPDX-License-Identifier: Apache-2.0
//
// Fit files with times of events.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "../../support/bouncing_ball.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {
namespace {

class EventFitJsonTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "event_fit_json/";
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ + "scene.json") << kBouncingBall;
    std::ofstream(folder_ + "heard.csv")
        << "time,event,number\n0.5,bounce,1\n1.2,bounce,2\n1.8,bounce,3\n";
    std::ofstream(folder_ + "fixed.json")
        << R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 1}}, "mass": 1,
               "position": [0, 1]}]})";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The message about a file; empty where there is none.
  std::string Read(const std::string& events, FitFile* fit, const std::string& more = "",
                   const std::string& sigma = "0.01", const std::string& scene = "scene") {
    std::string error;
    ParseFit(R"({"scene": ")" + scene +
                 R"(.json", "observations": [{"file": "heard.csv", "sigma": )" + sigma +
                 R"(}], "events": )" + events + R"(, "parameters": ["gravity/y"])" + more + "}",
             folder_ + "fit.json", fit, &error);
    return error.substr(error.find(": /") == std::string::npos ? 0 : error.find(": /") + 2);
  }
  std::string Read(const std::string& events, const std::string& more = "",
                   const std::string& sigma = "0.01", const std::string& scene = "scene") {
    FitFile fit;
    return Read(events, &fit, more, sigma, scene);
  }

  std::string folder_;
};

constexpr char kBounce[] = R"({"bounce": {"bodies": ["ball", "floor"], "kind": "touch"}})";

TEST_F(EventFitJsonTest, ReadsEventsAndTheirSigma) {
  FitFile fit;
  ASSERT_EQ(Read(kBounce, &fit, "", R"({"bounce": 0.25})"), "");
  const FitProblem& problem = fit.run();
  ASSERT_EQ(problem.instruments.events.size(), 1U);
  EXPECT_EQ(problem.instruments.events[0].name, "bounce");
  EXPECT_EQ(problem.instruments.events[0].bodies[1], 1);
  ASSERT_EQ(problem.observations.size(), 3U);
  EXPECT_EQ(problem.observations[2].number, 3);
  EXPECT_EQ(problem.observations[2].sigma, 0.25);
}

TEST_F(EventFitJsonTest, APartCountsFromItsStart) {
  FitFile fit;
  std::string error;
  ASSERT_TRUE(ParseFit(std::string(R"({"scene": "scene.json", "events": )") + kBounce +
                           R"(, "parameters": ["gravity/y"], "recordings": [{"name": "a",
              "start": 0.75, "observations": [{"file": "heard.csv", "sigma": 0.01}]}]})",
                       folder_ + "fit.json", &fit, &error))
      << error;
  const std::vector<Observation>& part = fit.input.recordings[0].problem.observations;
  ASSERT_EQ(part.size(), 2U);
  EXPECT_EQ(part[0].number, 1);
  EXPECT_NEAR(part[0].value, 0.45, 1e-15);
  EXPECT_EQ(part[1].number, 2);
}

TEST_F(EventFitJsonTest, MistakesAreOneLine) {
  EXPECT_EQ(Read(R"({"bounce": {"bodies": ["ball", "flor"], "kind": "touch"}})"),
            "/events/bounce/bodies/1: expected the name of a body (ball, floor), got \"flor\"");
  EXPECT_EQ(Read(R"({"bounce": {"bodies": ["ball"], "kind": "touch"}})"),
            "/events/bounce/bodies: expected the names of two bodies");
  EXPECT_EQ(Read(R"({"bounce": {"bodies": ["ball", "ball"], "kind": "touch"}})"),
            "/events/bounce/bodies/1: expected another body than the first, got \"ball\"");
  EXPECT_EQ(Read(R"({"bounce": {"bodies": ["ball", "floor"], "kind": "hit"}})"),
            "/events/bounce/kind: expected one of touch, lift_off, stick, slip, rest, got "
            "\"hit\"");
  EXPECT_NE(Read(R"({"bounce": {"bodies": ["ball", "floor"]}})").find("/events/bounce"),
            std::string::npos);
  EXPECT_EQ(Read(kBounce, R"(, "segments": 2)"),
            "/segments: expected 1 where times of events, accelerations or forces are observed, "
            "got 2");
  EXPECT_EQ(Read(kBounce, "", R"({"x": 1})"),
            "/observations/0/sigma: expected a sigma of bounce, which heard.csv has");
  EXPECT_EQ(Read(kBounce, "", "0.01", "fixed"),
            "/events: expected a scene with \"stepping\": \"event\", which locates events, got "
            "fixed steps");
}

}  // namespace
}  // namespace tangible
