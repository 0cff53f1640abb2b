// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_record.h"

#include <gtest/gtest.h>

#include "island_scenes.h"

namespace tangible {
namespace {

using test_scenes::Row;
using test_scenes::SceneOf;

TEST(IslandRecord, NamesBodiesOfTheWholeModel) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Row({0, 1, 2}, 1.0)), &model, &state);
  IslandRecord island;
  ActiveContact contact;
  contact.a = 0;
  contact.b = 3;
  EXPECT_TRUE(island.InWhole(contact).SameAs(contact));
  EXPECT_EQ(island.NumberInWhole(7), 7);
  Model<double> memory;
  EXPECT_EQ(&island.ModelOf(model, &memory), &model);
  island.part = std::make_shared<const ModelPart>(TakePart(*model.structure, {0, 3}));
  const ActiveContact own = island.InIsland(contact);
  EXPECT_EQ(own.a, 0);
  EXPECT_EQ(own.b, 1);
  EXPECT_TRUE(island.InWhole(own).SameAs(contact));
  contact.a = 2;
  EXPECT_EQ(island.InIsland(contact).a, -1);
  const Model<double>& part = island.ModelOf(model, &memory);
  const int mass = part.structure->bodies[1].mass;
  EXPECT_EQ(island.NumberInWhole(mass), model.structure->bodies[3].mass);
  EXPECT_EQ(part.parameters[mass], model.parameters[model.structure->bodies[3].mass]);
  EXPECT_EQ(island.NumberInWhole(-1), -1);
}

TEST(IslandRecord, KeepsItsMemory) {
  IslandRecords records;
  IslandRecord* first = records.Add();
  EXPECT_TRUE(records.IsWhole());
  first->events.Add();
  records.Add();
  EXPECT_FALSE(records.IsWhole());
  const size_t bytes = records.bytes();
  EXPECT_GT(bytes, 2 * sizeof(IslandRecord));
  records.Clear();
  EXPECT_EQ(records.Add(), first);
  EXPECT_EQ(first->events.num_parts, 0);
  EXPECT_EQ(records.bytes(), bytes);
}

TEST(IslandRecord, KinematicBodiesMoveByThemselves) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Row({0}, 1.0)), &model, &state);
  const State<double> before = state;
  IslandRecords records;
  records.h = 0.5;
  AdvanceKinematic(model, records, &state);
  EXPECT_EQ(state.pose[3], before.pose[3] - 0.1);
  EXPECT_EQ(state.pose[4], before.pose[4] + 0.005);
  state.pose[3] = before.pose[3];
  state.pose[4] = before.pose[4];
  EXPECT_EQ(state, before);
}

}  // namespace
}  // namespace tangible
