// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A page that replays a game: every picture that the agent saw, and the expected place of the ball.

#include <string>
#include <vector>

#include "tangible/estimation/experiments/breakout/agent/agent.h"
#include "tangible/estimation/experiments/breakout/game/breakout_game.h"

namespace tangible {

class Replay {
 public:
  /// Adds the current picture of the game; `agent` may be null.
  void Add(const BreakoutGame& game, const Agent* agent);
  /// The page; `below` is HTML under the game.
  std::string Html(const std::string& title, const std::string& below) const;

 private:
  struct Frame {
    int ball_x = 0, ball_y = 0, paddle_x = 0, width = 0, score = 0, lives = 0, expected = -1;
  };
  struct Wall {
    size_t frame = 0;
    std::string bricks;  ///< 0 or 1 of each
  };
  std::vector<Frame> frames_;
  std::vector<Wall> walls_;  ///< as they change
};

}  // namespace tangible
