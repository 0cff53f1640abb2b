// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Follows the ball from picture to picture with the flight model, and learns from its contacts.
//
// A ball that is where it was predicted has the predicted velocity. Otherwise its velocity is the
// difference of its places, and is accepted when the next picture agrees. When a velocity is
// accepted after exactly one contact, that contact is learned.

#include <optional>

#include "tangible/estimation/experiments/breakout/agent/flight.h"

namespace tangible {

/// The left edge of the paddle in each frame between two pictures.
struct PaddlePath {
  std::array<double, kFrameSkip + 1> x{};
  double width = 0.0;
};

class BallTracker {
 public:
  BallTracker(FlightModel* flights, Responses* responses)
      : flights_(flights), responses_(responses) {}

  /// Processes a picture: its ball, the bricks before it and in it, and the paddle since the last
  /// picture.
  void See(const Sight& sight, const Bricks& bricks_before, const PaddlePath& paddle);
  /// Whether the ball was seen lately.
  bool in_play() const { return seen_ && unseen_ <= kPatience; }
  /// Whether its velocity is known.
  bool known() const { return in_play() && known_; }
  const BallState& ball() const { return ball_; }
  /// Whether in the last See the ball was not at its predicted place.
  bool surprised() const { return surprised_; }
  /// Whether in the last See the paddle returned the ball, or was predicted to.
  bool returned() const { return returned_; }

 private:
  static constexpr int kPatience = 3;  ///< pictures without a ball, while it is hidden
  struct Met {
    Meeting meeting = Meeting::kSide;
    int row = 0;
    double offset = 0.0;
  };
  BallState Advance(const Bricks& bricks, const PaddlePath& paddle);
  void LearnFrom(const Vector2<double>& after);

  FlightModel* flights_;
  Responses* responses_;
  BallState ball_;
  bool seen_ = false, known_ = false, believed_ = false, surprised_ = false, returned_ = false;
  int unseen_ = 0;
  Vector2<double> before_{0.0, 0.0};  ///< the last velocity that was believed
  std::vector<Met> met_;              ///< since then
};

}  // namespace tangible
