// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of discs at the last of a few frames, from their positions in each of them.
//
// A disc that stays where it is rests. One that has moved uniformly over the last m ≥ 3 frames has
// the line through its m positions (least squares). One that has met something between the last two
// frames, a and b, has the velocity that the engine gives it from frame a. If its motion was not
// uniform before a either, its velocity at a is the difference to the frame before, or the engine's
// from that frame, whichever leads closer to the position seen at b. Where neither leads there, and
// where the engine meets nothing after a, the difference of the last two positions stands.
//
// Two discs that met each other, and nothing else, show the impulse's direction: with the free
// motion removed, m (r(b) − r(a) − v(a)) is the momentum that a disc received times the time since.
// Along this direction n the impulse of the two is
//
//   p = −(1 + e) ((vᵢ − vⱼ)·n) / (1/mᵢ + 1/mⱼ)
//
// which also holds where the discs overlapped before they turned, as SimB's do.

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
