// SPDX-License-Identifier: Apache-2.0
// Any bytes as a scene file: refused with one line, or run in both steppings.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "run_scene.h"
#include "tangible/scene/scene_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tangible::Scene scene;
  std::string error;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (!tangible::ParseScene(text, "scene.json", "/nonexistent/", &scene, &error)) {
    if (error.empty() || error.find('\n') != std::string::npos) std::abort();
    return 0;
  }
  if (!tangible::testing::FitToRun(scene)) return 0;
  tangible::testing::RunFewSteps(scene, tangible::Stepping::kFixed);
  tangible::testing::RunFewSteps(scene, tangible::Stepping::kEvent);
  return 0;
}
