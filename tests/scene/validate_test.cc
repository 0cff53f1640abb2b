// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/validate.h"

#include <gtest/gtest.h>

#include <string>

#include "scene_texts.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

Scene FullScene() {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(kFullScene, "s", ::testing::TempDir(), &scene, &error)) << error;
  return scene;
}

// A scene in memory is allowed exactly where its file can be read, with the same message.
TEST(ValidateTest, SaysWhatReadingTheFileSays) {
  const Scene full = FullScene();
  EXPECT_EQ(Validate(full, "s"), "");
  Scene scene = full;
  const auto numbers = EnumerateNumbers(&scene);
  int refused = 0;
  for (const SceneNumber<double>& number : numbers) {
    const double own = *number.value;
    for (const double value : {-1.0, 0.0, 0.5, 3.0, 1e300}) {
      *number.value = value;
      Scene read;
      std::string error;
      ParseScene(SceneToJson(scene), "s", ::testing::TempDir(), &read, &error);
      EXPECT_EQ(Validate(scene, "s"), error) << number.path << " " << value;
      refused += error.empty() ? 0 : 1;
    }
    *number.value = own;
  }
  EXPECT_GT(refused, 60);
  EXPECT_EQ(Validate(scene, "s"), "");
}

TEST(ValidateTest, SettingsAreCheckedToo) {
  Scene scene = FullScene();
  scene.simulation.dt = 1e-300;
  EXPECT_EQ(Validate(scene, "s"),
            "s: /simulation: expected at most 1e9 steps, got duration / dt = 3.0 / 1e-300");
}

}  // namespace
}  // namespace tangible
