// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_partition.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

std::string Body(const std::string& name, double x, double y, const std::string& more = "") {
  return R"({"name": ")" + name + R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
      "position": [)" +
         std::to_string(x) + ", " + std::to_string(y) + "]" + more + "}";
}

struct Divided {
  bool may = false, is = false;
  std::vector<std::vector<int>> islands;
};

using Together = IslandPartition::Together;

Divided Divide(const std::string& bodies, const std::string& more = "", double reach = -1.0,
               Together together = Together::kWithout, const EventGuess& last = {}) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}}, )" +
                     bodies + "]" + more + R"(, "simulation": {"stepping": "event"}})"),
             &model, &state);
  IslandPartition partition(model);
  Divided divided;
  divided.may = partition.MayDivide();
  partition.FindReach(model, state, 0.0, 0.1);
  if (reach >= 0.0) partition.SetReach(1, reach);
  partition.Divide(model, state, last);
  partition.List(*model.structure, together);
  divided.is = partition.IsDivided();
  for (int k = 0; k < partition.num_islands(); ++k) {
    divided.islands.push_back(partition.bodies(k));
    for (const int body : partition.bodies(k)) {
      const bool moves = model.structure->bodies[body].block >= 0;
      EXPECT_EQ(partition.IslandOf(body), moves ? k : -1);
    }
  }
  return divided;
}

using Islands = std::vector<std::vector<int>>;

TEST(IslandPartition, BodiesThatNothingCanTouchAreOneIsland) {
  const Divided apart = Divide(Body("a", 0, 5) + "," + Body("b", 1, 5));
  EXPECT_TRUE(apart.may);
  EXPECT_FALSE(apart.is);
  EXPECT_EQ(apart.islands, (Islands{{1, 2}}));
  const Divided one_lands = Divide(Body("a", 0, 5) + "," + Body("b", 1, 0.15));
  EXPECT_TRUE(one_lands.is);
  EXPECT_EQ(one_lands.islands, (Islands{{1}, {0, 2}}));
}

TEST(IslandPartition, BodiesThatMayMeetAreConnected) {
  // In 0.1 s gravity gives 1 m/s, so that each reaches 0.15 m.
  const std::string far = "," + Body("c", 9, 5);
  EXPECT_EQ(Divide(Body("a", 0, 5) + "," + Body("b", 0.51, 5) + far).islands, (Islands{{1, 2, 3}}));
  EXPECT_EQ(Divide(Body("a", 0, 5) + "," + Body("b", 0.49, 5) + far).islands,
            (Islands{{3}, {1, 2}}));
  EXPECT_EQ(
      Divide(Body("a", 0, 5, R"(, "velocity": [3, 0])") + "," + Body("b", 0.79, 5) + far).islands,
      (Islands{{3}, {1, 2}}));
  EXPECT_EQ(Divide(Body("a", 0, 5) + "," + Body("b", 0.9, 5) + far, "", 0.6).islands,
            (Islands{{3}, {1, 2}}));
}

TEST(IslandPartition, JointsAndSpringsConnectAndFixedBodiesDoNot) {
  const std::string four =
      Body("a", 0, 5) + "," + Body("b", 3, 5) + "," + Body("c", 6, 0.1) + "," + Body("d", 9, 0.1);
  EXPECT_EQ(Divide(four).islands, (Islands{{1, 2}, {0, 3}, {0, 4}}));
  const std::string joint = R"({"name": "j", "type": "distance", "bodies": ["a", "d"],
      "anchors": [[0, 5], [9, 0.1]]})";
  EXPECT_EQ(Divide(four, R"(, "joints": [)" + joint + "]").islands,
            (Islands{{2}, {0, 1, 4}, {0, 3}}));
  const std::string spring = R"({"name": "s", "bodies": ["b", "world"], "anchors": [[3, 5], [3, 6]],
      "stiffness": 1, "rest_length": 1})";
  EXPECT_EQ(Divide(four, R"(, "springs": [)" + spring + "]").islands,
            (Islands{{1}, {2}, {0, 3}, {0, 4}}));
  const Divided chain =
      Divide(Body("a", 0, 5) + "," + Body("d", 9, 4), R"(, "joints": [{"name": "j",
      "type": "distance", "bodies": ["a", "d"], "anchors": [[0, 5], [9, 4]]}])");
  EXPECT_FALSE(chain.may);
  EXPECT_FALSE(Divide(Body("a", 0, 5)).may);
}

// Of a body that rests on the floor no event is expected, unless another one comes near.
TEST(IslandPartition, BodiesWithoutExpectedEventsAreOneIsland) {
  EventGuess last;
  ActiveContact rests;
  rests.a = 0;
  rests.b = 1;
  last.contacts = {rests};
  last.modes = {ContactMode::kSticking};
  const std::string three = Body("a", 0, 0.1) + "," + Body("b", 3, 5) + "," + Body("c", 6, 0.1);
  const auto divide = [&](const std::string& bodies) {
    return Divide(bodies, "", -1.0, Together::kWithoutExpected, last).islands;
  };
  EXPECT_EQ(divide(three), (Islands{{0, 1, 2}, {0, 3}}));
  EXPECT_EQ(divide(three + "," + Body("d", 0.2, 0.4)), (Islands{{2}, {0, 1, 4}, {0, 3}}));
  last.modes = {ContactMode::kOpen};
  EXPECT_EQ(divide(three), (Islands{{2}, {0, 1}, {0, 3}}));
}

}  // namespace
}  // namespace tangible
