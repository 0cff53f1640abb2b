// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Breakout on a screen of 160 x 210 pixels, 60 frames a second, all in integers. It knows nothing
// of the engine. The rules with their sources stand in ../README.md; x grows to the right, y
// downwards, and positions are those of upper left corners.

#include <array>
#include <bitset>
#include <random>

#include "tangible/estimation/experiments/breakout/picture/picture.h"

namespace tangible {

/// The constants of the rules.
namespace breakout {
inline constexpr int kRows = 6, kColumns = 18, kBricks = kRows * kColumns;
inline constexpr int kBrickWidth = 8, kBrickHeight = 6, kBricksTop = 57;
inline constexpr std::array<int, kRows> kPoints = {7, 7, 4, 4, 1, 1};  ///< from the top
inline constexpr int kMostPoints = 864;                                ///< of two walls
inline constexpr int kLeft = 8, kRight = 152, kTop = 32;               ///< inner faces of the walls
inline constexpr int kBallWidth = 2, kBallHeight = 4, kServeY = 122;
inline constexpr int kPaddleTop = 189, kPaddleHeight = 4, kPaddleStart = 99;
inline constexpr int kPaddleWidth = 16, kNarrowPaddleWidth = 12;
inline constexpr int kPaddleSpeed = 6;  ///< at most, pixels a frame
inline constexpr int kLives = 5;
inline constexpr int kManyHits = 12;  ///< of the paddle, after which the ball is faster
inline constexpr int kFastRows = 3;   ///< the upper rows make it fastest
inline constexpr int kNumSpeeds = 5;
/// Pixels a frame (x, y) in even and in odd frames.
inline constexpr int kSpeeds[kNumSpeeds][2][2] = {
    {{1, 1}, {1, 1}}, {{2, 1}, {1, 1}}, {{1, 2}, {1, 1}}, {{2, 2}, {2, 2}}, {{2, 3}, {2, 3}}};
/// An episode ends after half an hour.
inline constexpr long kMostFrames = 108000;
}  // namespace breakout

struct BreakoutOptions {
  /// The probability, in each frame, that the button of the frame before is held instead.
  double sticky = 0.0;
  unsigned seed = 0;  ///< of sticky buttons
};

class BreakoutGame {
 public:
  explicit BreakoutGame(const BreakoutOptions& options)
      : options_(options), random_(options.seed) {}

  /// Starts a new game with a number of frames without a button.
  void Reset(int no_op_frames);
  /// Advances by one frame and returns the points that it won.
  int Frame(Button button);
  /// Holds the button over kFrameSkip frames, or until the game is over.
  int Step(Button button);
  void Draw(Picture* picture) const;

  bool over() const {
    return lives_ == 0 || score_ >= breakout::kMostPoints || frame_ >= breakout::kMostFrames;
  }
  int lives() const { return lives_; }
  int score() const { return score_; }
  long frame() const { return frame_; }

  // The state, for tests and for comparison with the learned knowledge.
  struct State {
    int paddle_x = 0, paddle_speed = 0, presses = 0;
    bool narrow = false;
    bool in_play = false;
    int ball_x = 0, ball_y = 0;
    int right = 1, down = 1;  ///< directions, ±1
    int speed = 0;            ///< into kSpeeds
    int hits = 0;             ///< of the paddle since the serve
    bool armed = true;        ///< the ball breaks the next brick that it meets
    bool cleared = false;
    int walls = 1;
    std::bitset<breakout::kBricks> bricks;  ///< row by row from the top left
  };
  const State& state() const { return state_; }
  void set_state(const State& state) { state_ = state; }

 private:
  void MovePaddle(Button button);
  void MoveBall();
  bool TouchesPaddle() const;
  void LeavePaddle();
  int BreakBrick();
  void Serve();

  BreakoutOptions options_;
  std::mt19937_64 random_;
  Button held_ = Button::kNone;
  State state_;
  int lives_ = 0, score_ = 0;
  long frame_ = 0;  ///< since the game began
};

}  // namespace tangible
