// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_derivative.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/gradients.h"
#include "island_scenes.h"

namespace tangible {
namespace {

using test_scenes::Row;
using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kDuration = 0.75;

// Of all balls' bodies and of what they share: floor, belt, gravity.
const std::vector<std::string> kShared = {"gravity/y",
                                          "bodies/floor/restitution",
                                          "bodies/belt/position/y",
                                          "bodies/belt/velocity/x",
                                          "bodies/belt/velocity/y",
                                          "bodies/ball*/friction"};

std::vector<std::string> Of(int ball) {
  const std::string body = "bodies/ball" + std::to_string(ball) + "/";
  return {body + "position/y", body + "velocity/x", body + "angular_velocity", body + "restitution",
          body + "shape/radius"};
}

TEST(IslandDerivative, AllMethodsAgree) {
  const Scene scene = SceneOf(Row({0, 1, 2, 3}, kDuration));
  std::vector<std::string> paths = kShared;
  for (const int ball : {0, 3}) {
    const std::vector<std::string> own = Of(ball);
    paths.insert(paths.end(), own.begin(), own.end());
  }
  const GradientResult adjoint = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_GT(adjoint.certificate.events, 10);
  ExpectOthersAgree(scene, paths, adjoint);
}

// The Jacobian of each ball is that of the ball alone, and no ball depends on another one.
TEST(IslandDerivative, EachBallHasTheJacobianThatItHasAlone) {
  const std::vector<int> balls = {0, 1, 2, 3};
  std::vector<std::string> paths = kShared;
  for (const int ball : balls) {
    const std::vector<std::string> own = Of(ball);
    paths.insert(paths.end(), own.begin(), own.end());
  }
  const Scene scene = SceneOf(Row(balls, kDuration));
  for (const GradientMethod method : {GradientMethod::kAdjoint, GradientMethod::kTangent}) {
    const GradientResult together = Jacobian(scene, paths, method, CertificatePass::kSkip);
    for (const int ball : balls) {
      std::vector<std::string> own_paths = kShared;
      const std::vector<std::string> own = Of(ball);
      own_paths.insert(own_paths.end(), own.begin(), own.end());
      const GradientResult alone =
          Jacobian(SceneOf(Row({ball}, kDuration)), own_paths, method, CertificatePass::kSkip);
      const auto shared = static_cast<Eigen::Index>(kShared.size());
      const auto of_ball = static_cast<Eigen::Index>(own.size());
      const auto rows = together.jacobian.middleRows(6 * ball, 6);
      const double largest = alone.jacobian.cwiseAbs().maxCoeff();
      ASSERT_GT(largest, 0.1);
      // Rounding of steps that all make together, which impacts multiply.
      const double rounding = 1e-11 * largest;
      EXPECT_LE((rows.leftCols(shared) - alone.jacobian.leftCols(shared)).cwiseAbs().maxCoeff(),
                rounding);
      for (const int other : balls) {
        const auto block = rows.middleCols(shared + of_ball * other, of_ball);
        if (other == ball) {
          EXPECT_LE((block - alone.jacobian.rightCols(of_ball)).cwiseAbs().maxCoeff(), rounding);
        } else {
          EXPECT_LE(block.cwiseAbs().maxCoeff(), rounding) << ball << " and " << other;
        }
      }
    }
  }
}

// The same through a certificate: an event of one ball says nothing about another one's.
TEST(IslandDerivative, TheCertificateCountsTheEventsOfAll) {
  const Scene scene = SceneOf(Row({0, 1, 2}, kDuration));
  const GradientResult together = Jacobian(scene, {"gravity/y"}, GradientMethod::kTangent);
  int events = 0;
  for (const int ball : {0, 1, 2}) {
    const GradientResult alone =
        Jacobian(SceneOf(Row({ball}, kDuration)), {"gravity/y"}, GradientMethod::kTangent);
    events += alone.certificate.events;
  }
  EXPECT_EQ(together.certificate.events, events);
  EXPECT_EQ(together.certificate.verdict, "trustworthy");
}

// Discs that slide and stop within the first step, which is divided: what their contacts at the
// start do to a derivative is found for each as for the disc alone.
TEST(IslandDerivative, TheStartIsCertifiedForEachIsland) {
  const auto scene = [](const std::vector<int>& discs) {
    std::string bodies =
        R"({"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}, "friction": 0.3})";
    for (const int i : discs) {
      bodies += R"(, {"name": "disc)" + std::to_string(i) +
                R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [)" +
                test_scenes::Number(i) + R"(, 0.1], "velocity": [)" +
                test_scenes::Number(0.01 + 0.003 * i) + R"(, 0], "friction": 0.3})";
    }
    return SceneOf(R"({"bodies": [)" + bodies +
                   R"(], "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.05}})");
  };
  Model<double> model;
  State<double> state;
  BuildModel(scene({0, 1, 2}), &model, &state);
  Stepper stepper(model);
  EXPECT_EQ(stepper.Step(model, 0.0, 0.01, &state).islands, 3);
  for (const char* path : {"bodies/disc1/position/y", "bodies/disc1/velocity/y",
                           "bodies/disc1/velocity/x", "bodies/floor/shape/offset"}) {
    const Certificate together =
        Jacobian(scene({0, 1, 2}), {path}, GradientMethod::kTangent).certificate;
    const Certificate alone = Jacobian(scene({1}), {path}, GradientMethod::kTangent).certificate;
    EXPECT_EQ(together.verdict.substr(0, 9), alone.verdict.substr(0, 9)) << path;
  }
  EXPECT_EQ(
      Jacobian(scene({0, 1, 2}), {"bodies/disc1/position/y"}, GradientMethod::kTangent)
          .certificate.one_sided,
      "contact of floor and disc1 touches at the start, bodies/disc1/position/y changes its gap");
}

}  // namespace
}  // namespace tangible
