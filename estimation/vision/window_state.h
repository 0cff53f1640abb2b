// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of discs at the last of a few frames, from their positions in each of them.
//
// A disc that stays where it is rests. One that has moved uniformly over the last m ≥ 3 frames has
// the line through its m positions (least squares). One that has met something between the last two
// frames, and moved uniformly before, has the velocity that the engine gives it from the frame
// before. Where that misses the position seen, and where something was met earlier, the difference
// of the last two positions stands.

#include <vector>

#include "tangible/estimation/vision/disc_rollout.h"

namespace tangible {

/// Pixels: second differences of positions below it count as uniform motion. Positions are seen to
/// 0.1 pixels, which makes them 0.24 in the mean.
inline constexpr double kUniformMotion = 0.3;
/// Pixels a frame: slower discs rest. Positions seen to 0.05 pixels in four frames give the slope
/// of a line to 0.02.
inline constexpr double kRests = 0.06;
/// Pixels: the engine's position after an impact is at most so far from the one seen. SimB's own
/// impacts are up to a substep late, 1.2 pixels of the way each.
inline constexpr double kImpactMissed = 2.5;

class WindowState {
 public:
  explicit WindowState(const DiscWorld& world);
  WindowState(const WindowState&) = delete;
  WindowState& operator=(const WindowState&) = delete;

  /// `seen`: (frames, n, 2), frames ≥ 2. Returns (n, 4) at the last frame.
  std::vector<double> operator()(const std::vector<double>& seen, int frames);

 private:
  RolloutFunction function_;  ///< one frame
  RolloutWorker worker_;
  int discs_;
};

}  // namespace tangible
