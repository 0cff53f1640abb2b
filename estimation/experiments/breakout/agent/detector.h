// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Finds walls, bricks, paddle and ball in pictures.
//
// It assumes a border of one colour around a black arena; rows of 18 bricks, each row of one
// colour; a paddle of one colour below them; and a ball whose colour differs from the background.
// It finds the places and sizes of these objects.

#include <bitset>
#include <vector>

#include "tangible/estimation/experiments/breakout/picture/picture.h"

namespace tangible {

inline constexpr int kBrickColumns = 18;
inline constexpr int kMostBricks = 256;
using Bricks = std::bitset<kMostBricks>;  ///< row by row from the top left

/// Pixels; x to the right, y downwards, of upper left corners. Rectangles end before x + width.
struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

/// The fixed objects: the inner faces of the walls and the places of bricks.
struct Arena {
  int left = 0, right = 0, top = 0;
  std::vector<Rectangle> bricks;
  int paddle_y = 0, paddle_height = 0;
};

struct Sight {
  bool paddle_seen = false, ball_seen = false;
  Rectangle paddle, ball;
  Bricks bricks;  ///< those that stand
};

class Detector {
 public:
  /// Returns false if the picture does not show such an arena.
  bool Start(const Picture& picture);
  bool started() const { return !arena_.bricks.empty(); }
  const Arena& arena() const { return arena_; }

  Sight Look(const Picture& picture);

 private:
  void FindBricks(const Picture& picture, Sight* sight);
  void FindPaddle(const Picture& picture, Sight* sight);
  void FindBall(const Picture& picture, Sight* sight) const;

  Arena arena_;
  std::vector<uint32_t> colours_;  ///< of bricks
  uint32_t paddle_colour_ = 0;
  Rectangle paddle_;    ///< as last seen
  Picture background_;  ///< what would be seen without ball and paddle
  Bricks drawn_;        ///< those in it
};

}  // namespace tangible
