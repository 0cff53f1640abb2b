// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Chooses the place on the paddle at which the ball should be met, so that it soon breaks bricks.
//
// The places on the paddle are divided into options: intervals that give the ball the same
// velocity. From each option the ball's further flight is followed by event stepping, return after
// return, breadth first, to the first returns that break bricks: of these the one with the most
// points, discounted by the frames until then, counts most. Places of the ball that were reached
// before are not followed again, so that the search ends, and loops that break nothing are left as
// soon as any sequence of returns leads out of them. If no such return is found, or the ball has
// come back too often without breaking a brick, an option is drawn at random.

#include <random>

#include "tangible/estimation/experiments/breakout/agent/flight.h"

namespace tangible {

/// An interval of offsets (ball's left edge − paddle's) that send the ball the same way.
struct AimOption {
  double low = 0.0, high = 0.0;
  Vector2<double> after{0.0, 0.0};
};

/// The options for a ball that comes to the paddle with that velocity.
std::vector<AimOption> AimOptions(const Responses& responses, const Vector2<double>& v,
                                  double width);

struct AimProblem {
  BallState arrival;    ///< as it overlaps the paddle's rows
  double frames = 0.0;  ///< until then
  Bricks bricks;
  double width = 0.0;        ///< of the paddle
  double paddle_x = 0.0;     ///< now
  double speed = 0.0;        ///< of the paddle, pixels/frame: what it cannot reach is no option
  double uncertainty = 0.0;  ///< standard deviation of where the paddle will be, pixels
};

struct Aim {
  AimOption option;
  /// The offset with the largest expected value, given the uncertainty of the paddle's place and
  /// the loss of a life if the ball is missed.
  double offset = 0.0;
  int flights = 0;      ///< that were followed
  bool random = false;  ///< nothing was found
};

Aim ChooseAim(const AimProblem& problem, const Responses& responses, FlightModel* flights,
              std::mt19937_64* random, bool break_loop);

}  // namespace tangible
