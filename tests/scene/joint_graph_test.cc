// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/joint_graph.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tangible {
namespace {

using P = JointPlace;

Scene SceneOf(const std::vector<Motion>& motions, const std::vector<std::array<int, 2>>& joints) {
  Scene scene;
  for (const Motion motion : motions) {
    scene.bodies.emplace_back();
    scene.bodies.back().motion = motion;
  }
  for (const auto& bodies : joints) {
    scene.joints.emplace_back();
    scene.joints.back().bodies[0] = bodies[0];
    scene.joints.back().bodies[1] = bodies[1];
  }
  return scene;
}

constexpr Motion kM = Motion::kMoving;
constexpr Motion kS = Motion::kStatic;
constexpr Motion kK = Motion::kKinematic;

TEST(ClassifyJointsTest, ChainFromTheWorld) {
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM, kM}, {{0, -1}, {1, 0}, {2, 1}})),
            (std::vector<P>{P::kTree, P::kTree, P::kTree}));
  // Written the other way round, the whole world would have to turn.
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM}, {{-1, 0}, {0, 1}})),
            (std::vector<P>{P::kFixedFirst, P::kFixedFirst}));
}

TEST(ClassifyJointsTest, AFreeTreeTurnsEitherWay) {
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM, kM}, {{0, 1}, {2, 1}})),
            (std::vector<P>{P::kTree, P::kTree}));
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM, kM}, {{1, 0}, {1, 2}})),
            (std::vector<P>{P::kTree, P::kTree}));
}

TEST(ClassifyJointsTest, Loops) {
  // A triangle with a tail.
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM, kM, kM}, {{0, 1}, {1, 2}, {2, 0}, {3, 0}})),
            (std::vector<P>{P::kLoop, P::kLoop, P::kLoop, P::kTree}));
  // Two joints of the same two bodies.
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM}, {{0, 1}, {1, 0}})),
            (std::vector<P>{P::kLoop, P::kLoop}));
}

TEST(ClassifyJointsTest, ARopeClosesNoLoop) {
  Scene scene = SceneOf({kM, kM}, {{0, -1}, {1, 0}, {1, -1}});
  scene.joints[2].type = JointType::kDistance;
  EXPECT_EQ(ClassifyJoints(scene), (std::vector<P>{P::kLoop, P::kLoop, P::kLoop}));
  scene.joints[2].limits = {0.0, 1.0};
  const std::vector<P> places = ClassifyJoints(scene);
  EXPECT_EQ(places[0], P::kTree);
  EXPECT_EQ(places[1], P::kTree);
}

TEST(ClassifyJointsTest, EverythingFixedIsOneNode) {
  // From the world over a body to a static one: a loop, as from a kinematic body to the world.
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kS}, {{0, -1}, {0, 1}})),
            (std::vector<P>{P::kLoop, P::kLoop}));
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kM, kK}, {{0, -1}, {1, 0}, {1, 2}})),
            (std::vector<P>{P::kLoop, P::kLoop, P::kLoop}));
  EXPECT_EQ(ClassifyJoints(SceneOf({kM, kK}, {{1, 0}})), (std::vector<P>{P::kFixedFirst}));
}

// By the definition: remove the joint and see what bodies[0] still reaches.
P Slow(const Scene& scene, std::size_t joint) {
  const auto node = [&scene](int body) {
    return body < 0 || scene.bodies[body].motion != kM ? 0 : body + 1;
  };
  std::vector<bool> reached(scene.bodies.size() + 1, false);
  reached[node(scene.joints[joint].bodies[0])] = true;
  for (bool grew = true; grew;) {
    grew = false;
    for (std::size_t j = 0; j < scene.joints.size(); ++j) {
      if (j == joint) continue;
      const int a = node(scene.joints[j].bodies[0]);
      const int b = node(scene.joints[j].bodies[1]);
      if (reached[a] == reached[b]) continue;
      reached[a] = reached[b] = true;
      grew = true;
    }
  }
  if (reached[node(scene.joints[joint].bodies[1])]) return P::kLoop;
  return reached[0] ? P::kFixedFirst : P::kTree;
}

TEST(ClassifyJointsTest, AgreesWithTheDefinitionOnRandomGraphs) {
  std::mt19937 random(5);
  int counts[3] = {0, 0, 0};
  for (int trial = 0; trial < 500; ++trial) {
    const int bodies = 1 + static_cast<int>(random() % 8);
    std::vector<Motion> motions;
    motions.reserve(bodies);
    for (int i = 0; i < bodies; ++i) motions.push_back(random() % 5 == 0 ? kS : kM);
    std::vector<std::array<int, 2>> joints;
    for (int i = static_cast<int>(random() % 9); i > 0; --i) {
      joints.push_back({static_cast<int>(random() % (bodies + 1)) - 1,
                        static_cast<int>(random() % (bodies + 1)) - 1});
    }
    const Scene scene = SceneOf(motions, joints);
    const std::vector<P> places = ClassifyJoints(scene);
    ASSERT_EQ(places.size(), joints.size());
    for (std::size_t j = 0; j < joints.size(); ++j) {
      EXPECT_EQ(places[j], Slow(scene, j)) << "trial " << trial << " joint " << j;
      ++counts[static_cast<int>(places[j])];
    }
  }
  for (const int count : counts) EXPECT_GT(count, 100);
}

TEST(ClassifyJointsTest, ALongChainDoesNotOverflowTheStack) {
  constexpr int kLinks = 200000;
  std::vector<std::array<int, 2>> joints;
  joints.reserve(kLinks);
  for (int i = 0; i < kLinks; ++i) joints.push_back({i, i - 1});
  const std::vector<P> places = ClassifyJoints(SceneOf(std::vector<Motion>(kLinks, kM), joints));
  for (const P place : places) ASSERT_EQ(place, P::kTree);
}

}  // namespace
}  // namespace tangible
