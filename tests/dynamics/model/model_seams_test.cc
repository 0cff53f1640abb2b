// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model_seams.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/model_part.h"

namespace tangible {
namespace {

Model<double> ModelOf(const std::string& bodies, const std::string& more = "") {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [)" + bodies + "]" + more + "}"), &model, &state);
  return model;
}

std::string Tile(const std::string& name, const std::string& x, const std::string& how) {
  return R"({"name": ")" + name + R"(", "shape": {"box": {"size": [1, 0.4]}}, "position": [)" + x +
         ", -0.2], " + how + "}";
}

const char kBall[] = R"(, {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
                           "position": [0, 0.1]})";
const char kStatic[] = R"("static": true)";

int NumWithSeams(const Model<double>& model) {
  return static_cast<int>(std::count_if(model.seams_of.begin(), model.seams_of.end(),
                                        [](int place) { return place >= 0; }));
}

TEST(ModelSeamsTest, StaticNeighboursHaveSeamsAndOthersDoNot) {
  EXPECT_EQ(ModelOf(Tile("a", "0", kStatic) + kBall).seams, nullptr);
  EXPECT_EQ(ModelOf(Tile("a", "0", kStatic) + "," + Tile("b", "1.001", kStatic) + kBall).seams,
            nullptr);
  const Model<double> model = ModelOf(Tile("a", "0", kStatic) + "," + Tile("b", "1", kStatic) +
                                      "," + Tile("c", "5", kStatic) + kBall);
  ASSERT_NE(model.seams, nullptr);
  EXPECT_EQ(NumWithSeams(model), 2);
  EXPECT_NE(model.SeamsOf(0, 0), nullptr);
  EXPECT_EQ(model.SeamsOf(2, 0), nullptr);
  EXPECT_EQ(model.SeamsOf(3, 0), nullptr);
}

TEST(ModelSeamsTest, KinematicBodiesMustMoveAlike) {
  const auto tiles = [](const std::string& a, const std::string& b) {
    return ModelOf(Tile("a", "0", R"("kinematic": true, )" + a) + "," +
                   Tile("b", "1", R"("kinematic": true, )" + b) + kBall);
  };
  EXPECT_NE(tiles(R"("velocity": [1, 0])", R"("velocity": [1, 0])").seams, nullptr);
  EXPECT_EQ(tiles(R"("velocity": [1, 0])", R"("velocity": [1, 0.1])").seams, nullptr);
  EXPECT_EQ(tiles(R"("angular_velocity": 1)", R"("angular_velocity": 1)").seams, nullptr);
}

TEST(ModelSeamsTest, ABodyThatIsNotTouchedHidesNothing) {
  const std::string tiles = Tile("a", "0", kStatic) + "," + Tile("b", "1", kStatic) + kBall;
  EXPECT_NE(ModelOf(tiles).seams, nullptr);
  EXPECT_EQ(ModelOf(tiles, R"(, "no_contact": [["ball", "b"]])").seams, nullptr);
}

TEST(ModelSeamsTest, APartKeepsWhatBodiesOutsideOfItHide) {
  const Model<double> whole =
      ModelOf(Tile("a", "0", kStatic) + "," + Tile("b", "1", kStatic) + kBall);
  const ModelPart part = TakePart(*whole.structure, {1, 2});
  Model<double> own;
  part.GatherModel(whole, &own);
  EXPECT_EQ(own.SeamsOf(0, 0), whole.SeamsOf(1, 0));
  EXPECT_EQ(own.SeamsOf(1, 0), nullptr);
}

}  // namespace
}  // namespace tangible
