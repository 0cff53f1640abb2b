// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/duality.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

// Links that hang, the last one of `mass`, pushed aside.
Scene Hanging(int links, double mass, const char* settings) {
  std::string bodies;
  std::string joints;
  for (int i = 0; i < links; ++i) {
    const std::string n = std::to_string(i);
    bodies += std::string(i > 0 ? "," : "") + R"({"name": "l)" + n +
              R"(", "shape": {"box": {"size": [0.02, 0.1]}}, "velocity": [)" +
              (i + 1 == links ? "0.01" : "0") + R"(, 0], "mass": )" +
              (i + 1 == links ? std::to_string(mass) : "1") + R"(, "position": [0, )" +
              std::to_string(-0.1 * i - 0.05) + "]}";
    joints += std::string(i > 0 ? "," : "") + R"({"name": "j)" + n +
              R"(", "type": "revolute", "bodies": ["l)" + n + R"(", ")" +
              (i > 0 ? "l" + std::to_string(i - 1) : "world") + R"("], "anchor": [0, )" +
              std::to_string(-0.1 * i) + "]}";
  }
  return test_scenes::SceneOf(R"({"bodies": [)" + bodies + R"(], "joints": [)" + joints +
                              R"(], "no_contact": [["l*", "l*"]], "simulation": )" + settings +
                              "}");
}

struct Built {
  explicit Built(const Scene& scene) {
    BuildModel(scene, &model, &initial);
    const ModelStructure& s = *model.structure;
    directions = RowMatrixXd::Zero(s.num_variables(), 2);
    directions(s.NumberVariable(s.bodies[0].mass), 0) = 1.0;
    directions(s.PoseVariable(0, 0), 1) = 1.0;
  }
  Model<double> model;
  State<double> initial;
  RowMatrixXd directions;
};

TEST(DualityTest, TangentAndAdjointOfAnOrdinarySceneAgree) {
  for (const char* settings :
       {R"({"dt": 0.01, "duration": 0.2})",
        R"({"dt": 0.01, "duration": 0.2, "stepping": "event", "integrator": "trapezoidal"})"}) {
    const Built b(Hanging(3, 1.0, settings));
    const double gap = DualityGap(b.model, b.initial, b.directions);
    EXPECT_LT(gap, 1e-11) << settings;
    EXPECT_FALSE(HasWideMasses(b.model));
  }
}

TEST(DualityTest, NoDirectionHasNoGap) {
  const Built b(Hanging(2, 1.0, R"({"dt": 0.01, "duration": 0.05})"));
  EXPECT_EQ(DualityGap(b.model, b.initial, RowMatrixXd(b.directions.rows(), 0)), 0.0);
}

// The certificate's linear residual is at least the gap: what it calls trustworthy agrees.
TEST(DualityTest, TheCertificateKnowsWhatATautChainLoses) {
  // With projection its joints do not hold at this step: the run ends.
  const char* settings = R"({"dt": 0.002, "duration": 0.02, "stepping": "event",
                             "integrator": "trapezoidal", "joint_correction": "none"})";
  const Built b(Hanging(30, 1e9, settings));
  ASSERT_TRUE(HasWideMasses(b.model));
  const double gap = DualityGap(b.model, b.initial, b.directions);
  const Certificate certificate =
      CertifyDerivative(b.model, b.initial, b.directions, {"mass", "position"});
  EXPECT_GE(certificate.linear_residual, gap);
  EXPECT_TRUE(certificate.verdict != "trustworthy" || gap <= kLinearResidualLimit) << gap;
  // Its links' motion is halved in some steps, how often rounding may choose.
  EXPECT_NE(certificate.verdict.find("motions were halved"), std::string::npos)
      << certificate.verdict;
}

}  // namespace
}  // namespace tangible
