// SPDX-License-Identifier: Apache-2.0
//
// Fit files with accelerations.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {
namespace {

class AccelerationFitJsonTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "acceleration_fit_json/";
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ + "scene.json") << kPendulum;
    std::ofstream(folder_ + "phone.csv") << "time,body,ax,ay,alpha\n0.5,bob,1,2,3\n";
    std::ofstream(folder_ + "seen.csv") << "time,body,x\n0.5,bob,1\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The message about a file with these further keys of its observations, without the file's name.
  std::string Read(const std::string& keys, FitFile* fit, const std::string& file = "phone",
                   const std::string& more = "") {
    std::string error;
    ParseFit(R"({"scene": "scene.json", "observations": [{"file": ")" + file +
                 R"(.csv", "sigma": 0.1)" + keys + R"(}], "parameters": ["gravity/y"])" + more +
                 "}",
             folder_ + "fit.json", fit, &error);
    const size_t name = error.find(": ");
    return name == std::string::npos ? error : error.substr(name + 2);
  }

  std::string folder_;
};

TEST_F(AccelerationFitJsonTest, ReadsFrameAndGravity) {
  FitFile fit;
  ASSERT_EQ(Read(R"(, "frame": "body", "gravity": true)", &fit), "");
  ASSERT_EQ(fit.run().observations.size(), 3U);
  EXPECT_EQ(fit.run().observations[2].coordinate, Coordinate::kAlpha);
  EXPECT_EQ(fit.run().observations[2].value, 3.0);
  EXPECT_TRUE(fit.run().channels[0].body_frame);
  EXPECT_TRUE(fit.run().channels[0].gravity);
  ASSERT_EQ(Read("", &fit), "");
  EXPECT_FALSE(fit.run().channels[0].body_frame);
  EXPECT_FALSE(fit.run().channels[0].gravity);
}

TEST_F(AccelerationFitJsonTest, MistakesAreOneLine) {
  FitFile fit;
  EXPECT_EQ(Read(R"(, "frame": "phone")", &fit),
            "/observations/0/frame: expected one of world, body, got \"phone\"");
  EXPECT_NE(Read(R"(, "gravity": 1)", &fit).find("/observations/0/gravity: expected"),
            std::string::npos);
  EXPECT_EQ(Read(R"(, "gravity": true)", &fit, "seen"),
            "/observations/0/gravity: expected a file with ax, ay or alpha, got seen.csv");
  EXPECT_EQ(Read(R"(, "relative_to": "bob")", &fit),
            "line 2: ax: expected no camera and no relative_to of an acceleration, got one");
  EXPECT_EQ(
      Read("", &fit, "phone", R"(, "segments": 2)"),
      "/segments: expected 1 where times of events, accelerations or forces are observed, got "
      "2");
}

}  // namespace
}  // namespace tangible
