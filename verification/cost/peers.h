// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The same scene in other engines that Debian ships, for benchmarks: discs, boxes and half-planes,
// joined by hinges. Built where they are installed.

#include <memory>

#include "tangible/scene/scene.h"

namespace tangible {

/// A scene of another engine; bodies have the indices of our scene.
class Peer {
 public:
  virtual ~Peer() = default;
  /// One step of the scene's dt.
  virtual void Step() = 0;
  virtual Vector2<double> PositionOf(int body) const = 0;
};

/// MuJoCo: Newton's method to 1e-8, pyramidal cone; hinged bodies in reduced coordinates. Null
/// where it is not installed.
std::unique_ptr<Peer> MujocoPeer(const Scene& scene);
/// Box2D: 8 velocity and 3 position iterations, no sleeping. Null where it is not installed.
std::unique_ptr<Peer> Box2dPeer(const Scene& scene);

}  // namespace tangible
