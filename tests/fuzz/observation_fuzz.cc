// SPDX-License-Identifier: Apache-2.0
// Any bytes as an observation file of two bodies and a point: refused with one line, or read as
// finite numbers of what there is.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tangible::Scene scene;
  scene.bodies.resize(2);
  scene.bodies[0].name = "ball";
  scene.bodies[1].name = "link1";
  const std::vector<tangible::BodyPoint> points = {{"tip", 1, {0.0, -0.5}}};
  std::vector<tangible::Observation> read;
  std::string error;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const bool ok =
      tangible::ParseObservations(text, "observation.csv", scene, points, {}, &read, &error);
  if (ok != error.empty() || error.find('\n') != std::string::npos) std::abort();
  for (const tangible::Observation& one : read) {
    if (!std::isfinite(one.value) || !(one.time >= 0.0 && one.time <= 1.0)) std::abort();
    if (one.body < 0 || one.body > 1 || one.point < -1 || one.point > 0) std::abort();
  }
  return 0;
}
