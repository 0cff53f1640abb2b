// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of discs at the last of a few frames, from their positions in each of them.
//
// A disc whose position does not change is at rest. The state of a disc that has moved uniformly
// over the last m ≥ 3 frames follows from the line through its m positions (least squares). A disc
// that has met something between the last two frames, a and b, has the velocity that the engine
// predicts from frame a. If its motion before a was not uniform either, its velocity at a is the
// difference to the frame before, or the velocity that the engine predicts from that frame,
// whichever leads closer to the position seen at b. Where neither does, and where the engine
// predicts no impact after a, the velocity is the difference of the last two positions.
//
// Two discs that met each other and nothing else show the direction n of the impulse: without the
// free motion, m (r(b) − r(a) − v(a)) is the momentum that a disc received, times the time since.
// Along n the impulse is
//
//   p = −(1 + e) ((vᵢ − vⱼ)·n) / (1/mᵢ + 1/mⱼ)
//
// which also holds where the discs overlap before their velocities change, as in SimB.

#include <vector>

#include "tangible/estimation/vision/disc_rollout.h"

namespace tangible {

class WindowState {
 public:
  explicit WindowState(const DiscWorld& world);
  WindowState(const WindowState&) = delete;
  WindowState& operator=(const WindowState&) = delete;

  /// `seen`: (frames, n, 2), frames ≥ 2. Returns (n, 4) at the last frame.
  std::vector<double> operator()(const std::vector<double>& seen, int frames);

 private:
  class Track;
  using States = std::vector<double>;  ///< (n, 4)

  RolloutOutput Run(const States& start);
  static void ByEngine(const Track& track, int disc, const RolloutOutput& found, int start,
                       double* least, double* state);
  void ByImpulse(const std::vector<Track>& tracks, const States& before, States* states) const;

  DiscWorld world_;
  RolloutFunction function_;  ///< two frames
  RolloutWorker worker_;
};

}  // namespace tangible
