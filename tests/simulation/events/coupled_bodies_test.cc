// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/coupled_bodies.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "active_contact.h"
#include "tangible/dynamics/model/model.h"

namespace tangible {
namespace {

using testing::Contact;

// Links 0 and 1 are hinged to each other, 2 and 3 touch, 4 stands alone on the floor (5), as 0 and
// 3 do; a spring connects 1 and 4.
TEST(CoupledBodiesTest, JointsAndContactsConnectMovingBodies) {
  std::string bodies;
  for (int i = 0; i < 5; ++i) {
    bodies += R"({"name": "b)" + std::to_string(i) +
              R"(", "mass": 1, "inertia": 1, "position": [)" + std::to_string(i) + ", 0]}, ";
  }
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [)" + bodies + R"({"name": "floor", "static": true,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "joints": [{"name": "hinge", "type": "revolute", "bodies": ["b1", "b0"], "anchor": [0.5, 0]},
                 {"name": "pin", "type": "revolute", "bodies": ["b2", "world"], "anchor": [2, 1]},
                 {"name": "nail", "type": "revolute", "bodies": ["b4", "world"], "anchor": [4, 1]}],
      "springs": [{"name": "s", "bodies": ["b1", "b4"], "anchors": [[1, 0], [4, 0]],
                   "stiffness": 1, "rest_length": 1}]})"),
             &model, &state);
  CoupledBodies coupled;
  coupled.Connect(*model.structure,
                  {Contact(3, 2), Contact(0, 5), Contact(3, 5), Contact(5, 4), Contact(3, 2)});
  EXPECT_EQ(coupled.GroupOf(0), 0);
  EXPECT_EQ(coupled.GroupOf(1), 0);
  EXPECT_EQ(coupled.GroupOf(2), 2);
  EXPECT_EQ(coupled.GroupOf(3), 2);
  EXPECT_EQ(coupled.GroupOf(4), 4);
  EXPECT_EQ(coupled.GroupOf(5), -1);
  EXPECT_EQ(coupled.GroupOf(Contact(5, 4)), 4);
  EXPECT_EQ(coupled.GroupOf(Contact(3, 5)), 2);
  coupled.Connect(*model.structure, {Contact(4, 3), Contact(1, 4)});
  for (const int body : {0, 1, 3, 4}) {
    EXPECT_EQ(coupled.GroupOf(body), 0);
  }
  EXPECT_EQ(coupled.GroupOf(2), 2);
}

}  // namespace
}  // namespace tangible
