// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/duality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"
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
    directions(s.ParameterVariable(s.bodies[0].mass), 0) = 1.0;
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

/// The gap of a scene's derivatives with respect to parameters.
struct Compared {
  double gap;
  std::string verdict;
};
Compared CompareAlong(const Scene& scene, const std::vector<std::string>& paths) {
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  std::vector<ParameterDirection> directions;
  std::vector<double> sizes;
  for (const std::string& path : paths) {
    ParameterPath parameter;
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
    directions.push_back(DirectionOf(parameter));
    sizes.push_back(std::max(std::abs(parameter.value), parameter.scale));
  }
  const RowMatrixXd along = VariableJacobian(scene, model.structure, directions);
  return {DualityGap(model, initial, along, sizes),
          CertifyDerivative(model, initial, along, paths, sizes).verdict};
}

/// A box on a box, of these masses, and `others` bodies that fall beside them.
Scene BoxOnBox(const std::string& lower, const std::string& upper, const std::string& stepping,
               int others = 0) {
  std::string bodies;
  for (int i = 0; i < others; ++i) {
    bodies += R"({"name": "ball)" + std::to_string(i) +
              R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [)" +
              std::to_string(3 + i) + ", 9]}, ";
  }
  const auto box = [](const char* name, const std::string& mass, const char* y) {
    return std::string(R"({"name": ")") + name +
           R"(", "shape": {"box": {"size": [1, 1]}}, "friction": 0.5, "mass": )" + mass +
           R"(, "position": [0, )" + y + "]}, ";
  };
  return test_scenes::SceneOf(R"({"bodies": [)" + bodies + box("lower", lower, "0.5") +
                              box("upper", upper, "1.5") +
                              R"({"name": "floor", "static": true, "friction": 0.5,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.2, "stepping": ")" +
                              stepping + R"("}})");
}

// What rests has derivatives that are 0, in both sweeps rounding of their own: a change of gravity
// by all of its size moves it by 1e-20 m.
TEST(DualityTest, RoundingOfWhatRestsIsNoDifference) {
  const std::vector<std::string> paths = {"bodies/lower/mass", "bodies/upper/mass",
                                          "bodies/lower/friction", "gravity/x"};
  for (const char* stepping : {"fixed", "event"}) {
    for (const auto& [lower, upper] : {std::pair("1", "1e3"), std::pair("1e3", "1")}) {
      const Compared compared = CompareAlong(BoxOnBox(lower, upper, stepping), paths);
      EXPECT_LT(compared.gap, 1e-11) << stepping << lower;
      EXPECT_EQ(compared.verdict, "trustworthy") << stepping << lower;
    }
  }
  for (const double end : {1e3, 1e6}) {
    const Compared compared = CompareAlong(Hanging(20, end, R"({"dt": 0.01, "duration": 0.05})"),
                                           {"bodies/l19/mass", "gravity/x"});
    EXPECT_LT(compared.gap, 1e-10) << end;
    EXPECT_EQ(compared.verdict, "trustworthy") << end;
  }
}

// Without gravity the motor's effort alone tells what rounding is.
TEST(DualityTest, RoundingOfAMotorThatASupportHoldsIsNoDifference) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "a",
        "mass": 1, "inertia": 0.05, "position": [0.3, 0], "support": {"friction": 0.2, "load": 10}}],
        "joints": [{"name": "h", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                    "motor": {"speed": 1, "limit": 0.5}}],
        "simulation": {"dt": 0.01, "duration": 0.5, "stepping": ")" +
                                             std::string(stepping) + R"("}})");
    const Compared compared = CompareAlong(scene, {"bodies/a/mass", "joints/h/motor/limit"});
    EXPECT_LT(compared.gap, 1e-11) << stepping;
    EXPECT_EQ(compared.verdict, "trustworthy") << stepping;
  }
}

// A sideways pull on a million tonnes that stand on a kilogram: by the tangent the lower box stays
// where it is, by the adjoint it moves by 4e-9 m for 1 m/s². That is seen among many other bodies
// too, whose outputs share columns of the adjoint.
TEST(DualityTest, OneEntryThatIsWrongIsSeenAmongManyThatAreRight) {
  for (const int others : {0, 40}) {
    const Compared compared =
        CompareAlong(BoxOnBox("1", "1e9", "event", others), {"gravity/x", "bodies/upper/mass"});
    EXPECT_GT(compared.gap, 1e-7) << others;
    EXPECT_NE(compared.verdict.find("linear systems"), std::string::npos) << compared.verdict;
  }
}

// Eight capsules of 1e-6 m are pushed against each other and a wall. Their rows are redundant, and
// tangent and adjoint differ in the third digit of some entries.
TEST(DualityTest, RedundantRowsAreComparedToo) {
  std::string bodies;
  for (int i = 0; i < 8; ++i) {
    bodies += R"({"name": "c)" + std::to_string(i) +
              R"(", "shape": {"capsule": {"length": 4e-6, "radius": 1e-6}}, "mass": 1,
                  "friction": 0.8, "position": [)" +
              std::to_string(6 * i) + "e-6, 1e-6]}, ";
  }
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [)" + bodies + R"(
      {"name": "wall", "static": true, "friction": 0.8,
       "shape": {"half_plane": {"normal": [-1, 0], "offset": -4.5e-5}}},
      {"name": "floor", "static": true, "friction": 0.8,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "forces": [{"name": "push", "body": "c0", "force": [5, 0]}],
      "simulation": {"dt": 0.005, "duration": 0.02}})");
  const Compared compared =
      CompareAlong(scene, {"bodies/c*/shape/radius", "bodies/c3/position/y", "bodies/c3/friction"});
  EXPECT_GT(compared.gap, 1e-7);
  EXPECT_NE(compared.verdict.find("linear systems"), std::string::npos) << compared.verdict;
}

}  // namespace
}  // namespace tangible
