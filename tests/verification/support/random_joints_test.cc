// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>

#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

TEST(RandomJointsTest, EveryTypeLimitsAndLoopsTakeTheirTurn) {
  std::map<JointType, int> types;
  int limited = 0, narrow = 0, loops = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Scene scene = RandomScene(seed);
    bool loop = false;
    for (const auto& joint : scene.joints) {
      ++types[joint.type];
      limited += joint.limits ? 1 : 0;
      if (joint.limits) {
        EXPECT_LT(joint.limits->first, joint.limits->second) << seed;
        EXPECT_LE(joint.limits->first, joint.angle) << seed;
        EXPECT_GE(joint.limits->second, joint.angle) << seed;
        narrow += joint.limits->second - joint.limits->first < 0.01 ? 1 : 0;
      }
      if (joint.type == JointType::kCoupling) continue;
      loop = loop || scene.bodies[joint.bodies[0]].name.rfind("bar", 0) == 0;
    }
    loops += loop ? 1 : 0;
  }
  EXPECT_EQ(types.size(), 6u);
  for (const auto& [type, count] : types) {
    EXPECT_GE(count, type == JointType::kCoupling ? 4 : 10) << static_cast<int>(type);
  }
  EXPECT_GE(limited, 20);
  EXPECT_GE(narrow, 3);
  EXPECT_GE(loops, 10);
}

}  // namespace
}  // namespace tangible
