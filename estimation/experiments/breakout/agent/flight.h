// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Predicts the flight of the ball by event stepping in a scene of ball, walls, bricks and the line
// of the paddle, with 1 m for a pixel, 1 s for a frame, and y upwards. The scene has only the few
// bricks that the straight flight of the ball reaches first.
//
// The engine locates each contact and gives the velocity of a rigid ball after it. The game differs
// from that in three ways that are modelled here:
//   - it moves the ball by whole frames: a meeting counts at the end of its frame. Walls put the
//     ball back to their faces; bricks and the paddle do not;
//   - the ball leaves with the velocity that Responses say;
//   - after a brick it flies through others until it has met a wall (beside bricks it does not
//     count), the ceiling or the paddle.

#include <vector>

#include "tangible/estimation/experiments/breakout/agent/detector.h"
#include "tangible/estimation/experiments/breakout/agent/responses.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

inline constexpr int kBallAcross = 2, kBallDown = 4;  ///< pixels

/// Upper left corner in pixels, y downwards; pixels a frame.
struct BallState {
  Vector2<double> at{0.0, 0.0}, v{0.0, 0.0};
  bool armed = true;  ///< it breaks the next brick that it meets
};

struct FlightMeeting {
  Meeting meeting = Meeting::kSide;
  int brick = -1;
  double frames = 0.0;  ///< since the start of the flight
  BallState before, after;
};

struct Flight {
  std::vector<FlightMeeting> meetings;
  /// Whether the ball comes down to the paddle within the given frames. If it does, `end` is the
  /// ball in the first frame in which it overlaps the rows of the paddle; otherwise `end` is the
  /// ball after all frames.
  bool arrives = false;
  double frames = 0.0;
  BallState end;
  Bricks bricks;  ///< left
};

class FlightModel {
 public:
  FlightModel(const Arena& arena, const Responses* responses);

  Flight Predict(const BallState& ball, const Bricks& bricks, double frames);
  const Arena& arena() const { return arena_; }
  int RowOf(int brick) const { return brick / kBrickColumns; }
  long num_steps() const { return num_steps_; }

 private:
  /// Finds the first contact within `frames`; returns false where there is none.
  bool FirstMeeting(const BallState& ball, const Bricks& bricks, double frames, int* body,
                    double* when, Vector2<double>* rigid);
  void Place(const BallState& ball, const Bricks& bricks, double frames);
  void PlaceBricks(const BallState& ball, const Bricks& bricks, double frames);
  void Turn(int body, const Vector2<double>& rigid, Flight* flight);

  Arena arena_;
  const Responses* responses_;
  Model<double> model_;
  State<double> home_, state_;  ///< as built; as placed
  std::vector<int> placed_;     ///< of each body for a brick: which it is
  std::unique_ptr<Stepper> stepper_;
  long num_steps_ = 0;
};

}  // namespace tangible
