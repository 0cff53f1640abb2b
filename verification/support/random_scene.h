// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random scenes for checks of the engine: every shape, joint, force and setting in turn, placed so
// that contacts close, slide, stick, bounce and rest within the few steps they run.
//
// The same seed gives the same scene on every machine: the generator is std::mt19937_64 with our
// own uniform distribution (those of the standard library are not the same everywhere).

#include <cstdint>
#include <random>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

/// Uniform numbers from 53 bits of the engine each.
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : engine_(seed) {}
  /// In [low, high).
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  /// In {low, ..., high}.
  int Integer(int low, int high) { return low + static_cast<int>(Uniform(0.0, high - low + 1.0)); }
  bool Chance(double probability) { return Uniform(0.0, 1.0) < probability; }

 private:
  std::mt19937_64 engine_;
};

struct RandomSceneOptions {
  int max_bodies = 8;   ///< moving ones, at least 1
  int max_steps = 200;  ///< most scenes have at most 40
  Stepping stepping = Stepping::kFixed;
};

/// A valid scene. Bodies are apart or touch at their start, except for those meant to start in
/// penetration; loops of joints are consistent; the edges of force windows do not coincide with the
/// ends of steps.
Scene RandomScene(unsigned seed, const RandomSceneOptions& options = {});

}  // namespace tangible
