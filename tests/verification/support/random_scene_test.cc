// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/random_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

int NumMoving(const Scene& scene) {
  return static_cast<int>(
      std::count_if(scene.bodies.begin(), scene.bodies.end(),
                    [](const auto& body) { return body.motion == Motion::kMoving; }));
}

TEST(RandomNumbersTest, AreTheSameEverywhere) {
  // The 10000th number of std::mt19937_64 with its default seed is 9981545732273789042 (the C++
  // standard, [rand.predef]).
  RandomNumbers random(5489);
  for (int i = 1; i < 10000; ++i) random.Uniform(0.0, 1.0);
  EXPECT_EQ(random.Uniform(0.0, 1.0), static_cast<double>(9981545732273789042ULL >> 11) * 0x1p-53);
}

TEST(RandomNumbersTest, StayInTheirRange) {
  RandomNumbers random(3);
  int counts[4] = {0, 0, 0, 0};
  int chances = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.Uniform(-2.0, 3.0);
    EXPECT_GE(x, -2.0);
    EXPECT_LT(x, 3.0);
    const int k = random.Integer(-1, 2);
    ASSERT_GE(k, -1);
    ASSERT_LE(k, 2);
    ++counts[k + 1];
    chances += random.Chance(0.25) ? 1 : 0;
  }
  // Binomial: n p ± 5 sqrt(n p (1 − p)).
  const double spread = 5.0 * std::sqrt(kDraws * 0.25 * 0.75);
  for (const int count : counts) EXPECT_NEAR(count, 0.25 * kDraws, spread);
  EXPECT_NEAR(chances, 0.25 * kDraws, spread);
}

TEST(RandomSceneTest, ASeedIsAScene) {
  EXPECT_EQ(SceneToJson(RandomScene(5)), SceneToJson(RandomScene(5)));
  Scene other = RandomScene(6);
  other.name = RandomScene(5).name;
  EXPECT_NE(SceneToJson(RandomScene(5)), SceneToJson(other));
}

TEST(RandomSceneTest, ScenesKeepTheirLimits) {
  RandomSceneOptions options;
  options.max_bodies = 3;
  options.max_steps = 10;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Scene scene = RandomScene(seed, options);
    EXPECT_GE(NumMoving(scene), 1) << seed;
    EXPECT_LE(NumMoving(scene), 3) << seed;
    EXPECT_LE(scene.simulation.duration, scene.simulation.dt * (10.0 + 1e-9)) << seed;
    EXPECT_GT(scene.simulation.duration, 0.0) << seed;
  }
}

TEST(RandomSceneTest, NumbersOfBodiesReachTheirLimit) {
  int most = 0;
  int pairs = 0;
  int filters = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Scene scene = RandomScene(seed);
    most = std::max(most, NumMoving(scene));
    pairs += scene.pairs.empty() ? 0 : 1;
    filters += scene.no_contact.empty() ? 0 : 1;
  }
  EXPECT_EQ(most, 8);
  EXPECT_GE(pairs, 5);
  EXPECT_GE(filters, 5);
}

TEST(RandomSceneTest, ScenesOfBothSteppingsAreTheSame) {
  RandomSceneOptions options;
  options.stepping = Stepping::kEvent;
  Scene event = RandomScene(7, options);
  EXPECT_EQ(event.simulation.stepping, Stepping::kEvent);
  event.simulation.stepping = Stepping::kFixed;
  event.simulation.integrator.reset();
  event.simulation.duration = RandomScene(7).simulation.duration;
  EXPECT_EQ(SceneToJson(event), SceneToJson(RandomScene(7)));
}

}  // namespace
}  // namespace tangible
