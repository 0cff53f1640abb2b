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
const std::vector<std::string> kShared = {"gravity/y", "bodies/floor/restitution",
                                          "bodies/belt/position/y", "bodies/belt/velocity/x",
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

}  // namespace
}  // namespace tangible
