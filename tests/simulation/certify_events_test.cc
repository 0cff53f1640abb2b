// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "../support/scenes.h"
#include "tangible/simulation/certify.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

Certificate CertificateOf(const std::string& bodies, double duration,
                          const std::string& more = "") {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf("{" + bodies + R"(, "simulation": {"stepping": "event",
      "integrator": "trapezoidal", "dt": 0.01, "duration": )" +
                     std::to_string(duration) + more + "}}"),
             &model, &state);
  return CertifyRollout(model, state);
}

std::string Floor() {
  return R"({"name": "floor", "static": true, "friction": 0.3, "restitution": 0.5,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
}

TEST(CertifyEventsTest, ABounceIsTrustworthy) {
  const Certificate c = CertificateOf(R"("bodies": [{"name": "ball",
      "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1], "restitution": 0.5}, )" +
                                          Floor() + "]",
                                      0.6);
  EXPECT_EQ(c.verdict, "trustworthy");
  EXPECT_EQ(c.events, 1);
}

TEST(CertifyEventsTest, AFlatLandingIsADiscontinuity) {
  const Certificate c = CertificateOf(R"("bodies": [{"name": "box",
      "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 1]}, )" +
                                          Floor() + "]",
                                      0.6);
  EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
  EXPECT_NE(c.verdict.find("box touch at once"), std::string::npos) << c.verdict;
}

TEST(CertifyEventsTest, ATouchingCradleIsADiscontinuity) {
  const Certificate c = CertificateOf(R"("gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [-0.5, 0],
       "velocity": [1, 0], "restitution": 1},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0], "restitution": 1},
      {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.2, 0],
       "restitution": 1}])",
                                      1.0);
  EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
}

TEST(CertifyEventsTest, AnApproachAtTheThresholdIsADiscontinuity) {
  const Certificate c = CertificateOf(R"("gravity": [0, 0], "bodies": [{"name": "ball",
      "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1005], "velocity": [0, -1e-3],
      "restitution": 0.5}, )" + Floor() + "]",
                                      0.8);
  EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
  EXPECT_NE(c.verdict.find("threshold"), std::string::npos) << c.verdict;
}

TEST(CertifyEventsTest, FrictionAtItsLimitIsAKink) {
  // tan of the slope = μ exactly.
  const Certificate c = CertificateOf(R"("gravity": [2.4, -8], "bodies": [{"name": "box",
      "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1], "friction": 0.3}, )" +
                                          Floor() + "]",
                                      0.1);
  EXPECT_EQ(c.verdict.find("near a kink: "), 0u) << c.verdict;
}

}  // namespace
}  // namespace tangible
