// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Hand-written players that learn nothing and see what the agent sees.
//
//   random      presses any button
//   follow      keeps the paddle's middle below the ball
//   intercept   moves it to where the ball will come down, reflected at the side walls; meets it
//               aside of the middle when nothing was broken for long, so that no loop goes on

#include <functional>
#include <random>

#include "tangible/estimation/experiments/breakout/picture/picture.h"

namespace tangible {

/// The next button, from the picture, the points since the last picture, and the lives.
using Player = std::function<Button(const Picture&, double, int)>;

Player RandomPlayer(unsigned seed);
Player FollowingPlayer();
Player InterceptingPlayer(unsigned seed);

}  // namespace tangible
