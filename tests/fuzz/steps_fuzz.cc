// SPDX-License-Identifier: Apache-2.0
// Valid scenes that bytes choose: a random scene by its seed, then some of its numbers moved to
// their extremes, stepped both ways. Nothing may crash, hang or give a number that is not finite.
#include <cmath>
#include <cstdint>
#include <string>

#include "run_scene.h"
#include "tangible/scene/scene_json.h"
#include "tangible/verification/support/random_scene.h"

namespace {

// Bytes one after the other; zeros after the last.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool left() const { return at_ < size_; }
  int Next() { return left() ? data_[at_++] : 0; }
  unsigned Seed() {
    const int low = Next();
    return static_cast<unsigned>(low + 256 * Next());
  }
  // A size between 1e-9 and 1e9.
  double Size() { return std::pow(10.0, (Next() - 128) / 14.2); }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

void MoveOneNumber(Bytes* bytes, tangible::Scene* scene) {
  auto& body = scene->bodies[bytes->Next() % scene->bodies.size()];
  switch (bytes->Next() % 10) {
    case 0: {
      const double factor = bytes->Size();
      body.mass *= factor;
      if (body.inertia) *body.inertia *= factor;
      break;
    }
    case 1:
      body.inertia = body.mass * bytes->Size();
      break;
    case 2:
      body.friction = bytes->Size();
      break;
    case 3:
      body.restitution = bytes->Next() / 255.0;
      break;
    case 4:
      body.velocity[bytes->Next() % 2] = (bytes->Next() - 128) * bytes->Size() * 1e-3;
      break;
    case 5:
      body.angular_velocity = (bytes->Next() - 128) * bytes->Size() * 1e-3;
      break;
    case 6:
      body.position[bytes->Next() % 2] += (bytes->Next() - 128) * 1e-3;
      break;
    case 7:
      body.angle += (bytes->Next() - 128) * 0.05;
      break;
    case 8:
      scene->simulation.dt *= std::pow(10.0, (bytes->Next() % 9) - 6);
      break;
    default:
      scene->gravity[bytes->Next() % 2] = (bytes->Next() - 128) * bytes->Size() * 1e-3;
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  tangible::RandomSceneOptions options;
  options.max_bodies = 5;
  options.max_steps = 4;
  options.stepping =
      bytes.Next() % 2 == 0 ? tangible::Stepping::kFixed : tangible::Stepping::kEvent;
  tangible::Scene moved = tangible::RandomScene(bytes.Seed(), options);
  while (bytes.left()) MoveOneNumber(&bytes, &moved);
  // What the reader refuses is no scene.
  tangible::Scene scene;
  std::string error;
  if (!tangible::ParseScene(tangible::SceneToJson(moved), "scene.json", "", &scene, &error))
    return 0;
  tangible::testing::RunFewSteps(scene, options.stepping);
  return 0;
}
