// SPDX-License-Identifier: Apache-2.0
//
// Fit files with forces of joints and contacts.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {
namespace {

class ForceFitJsonTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "force_fit_json/";
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ + "scene.json") << kPendulum;
    std::ofstream(folder_ + "box.json") << kSlidingBox;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The message about a fit to this file, without the name of the file it is about.
  std::string Read(const std::string& csv, FitFile* fit, const std::string& keys = "",
                   const std::string& more = "", const std::string& scene = "scene") {
    std::ofstream(folder_ + "cell.csv") << csv;
    std::string error;
    ParseFit(R"({"scene": ")" + scene + R"(.json", "observations": [{"file": "cell.csv")" + keys +
                 R"(}], "parameters": ["gravity/y"])" + more + "}",
             folder_ + "fit.json", fit, &error);
    const size_t name = error.find(": ");
    return name == std::string::npos ? error : error.substr(name + 2);
  }

  std::string folder_;
};

TEST_F(ForceFitJsonTest, ReadsJointsAndContacts) {
  FitFile fit;
  ASSERT_EQ(Read("time,joint,fx,fy,torque\n0.5,pin,1,2,3\n", &fit,
                 R"(, "sigma": {"fx": 0.1, "fy": 0.2, "torque": 0.3})"),
            "");
  ASSERT_EQ(fit.run().observations.size(), 3U);
  EXPECT_EQ(fit.run().observations[1].coordinate, Coordinate::kFy);
  EXPECT_EQ(fit.run().observations[1].joint, 0);
  EXPECT_EQ(fit.run().observations[1].sigma, 0.2);
  EXPECT_EQ(fit.run().observations[2].value, 3.0);
  ASSERT_EQ(
      Read("time,contact,normal,tangent\n0.5,floor:box,1,\n", &fit, R"(, "sigma": 0.1)", "", "box"),
      "");
  ASSERT_EQ(fit.run().observations.size(), 1U);
  EXPECT_EQ(fit.run().observations[0].coordinate, Coordinate::kNormal);
  EXPECT_EQ(fit.run().observations[0].pair[0], 1);
  EXPECT_EQ(fit.run().observations[0].pair[1], 0);
}

TEST_F(ForceFitJsonTest, MistakesAreOneLine) {
  FitFile fit;
  const std::string sigma = R"(, "sigma": 0.1)";
  EXPECT_EQ(Read("time,joint,fx\n0.5,hinge,1\n", &fit, sigma),
            "line 2: joint: expected the name of a joint (pin), got \"hinge\"");
  EXPECT_EQ(Read("time,contact,normal\n0.5,bob:bob,1\n", &fit, sigma),
            "line 2: contact: expected the names of two bodies (bob) as \"a:b\", got \"bob:bob\"");
  EXPECT_EQ(Read("time,joint,normal\n0.5,pin,1\n", &fit, sigma),
            "header: expected the coordinates of a joint (fx, fy or torque), got normal");
  EXPECT_EQ(Read("time,body,fx\n0.5,bob,1\n", &fit, sigma),
            "header: expected the coordinates of a body (x, y, angle, vx, vy, omega, distance, ax, "
            "ay or alpha), got fx");
  EXPECT_EQ(Read("time,joint,body,fx\n0.5,pin,bob,1\n", &fit, sigma),
            "header: expected one column body, point, joint or contact, got several");
  EXPECT_EQ(Read("time,joint\n0.5,pin\n", &fit, sigma),
            "header: expected a column fx, fy or torque, got none of them");
  EXPECT_EQ(Read("time,joint,fx\n0.5,pin,1\n", &fit, R"(, "sigma": 0.1, "relative_to": "bob")"),
            "line 2: fx: expected no camera and no relative_to of a force, got one");
  EXPECT_EQ(Read("time,joint,fx\n0.5,pin,1\n", &fit, sigma, R"(, "segments": 2)"),
            "/segments: expected 1 where times of events, accelerations or forces are observed, "
            "got 2");
  EXPECT_EQ(Read("time,joint,fx\n0.5,pin,1\n", &fit, R"(, "sigma": {"fy": 0.1})"),
            "/observations/0/sigma: expected a sigma of fx, which cell.csv has");
}

}  // namespace
}  // namespace tangible
