// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/game/breakout_game.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "tangible/math/random.h"

namespace tangible {
namespace {

using namespace breakout;  // NOLINT(google-build-using-namespace): the numbers of the rules

// Pixels a frame that a press adds to the paddle's speed in its first, second, ... frame: free, and
// with the paddle at a wall.
constexpr int kPresses = 5;
constexpr int kGains[kPresses] = {3, 2, -1, 1, 1}, kGainsAtWall[kPresses] = {1, 2, 1, 1, 1};
constexpr int kPaddleEnd = kRight - kPaddleWidth;  // the same for the narrow paddle
constexpr int kServes[4] = {16, 78, 80, 142};
constexpr int kNear = 2;  // the ball strikes a side of the paddle within this
constexpr int kDeep = 4;  // a brick turns a ball whose upper edge is this near to its lower edge
constexpr int kSections = 5;  // of the wide paddle
constexpr uint32_t kWallColour = 0x8e8e8e, kBallColour = 0xc84848;
constexpr uint32_t kRowColours[kRows] = {0xc84848, 0xc66c3a, 0xb47a30,
                                         0xa2a22a, 0x48a048, 0x4248c8};

// Half of it, rounded to the nearest integer, and to the even one of two equally near ones.
int Half(int value) { return static_cast<int>(std::nearbyint(0.5 * value)); }

}  // namespace

void BreakoutGame::Reset(int no_op_frames) {
  state_ = State();
  state_.paddle_x = kPaddleStart;
  state_.bricks.set();
  lives_ = kLives;
  score_ = 0;
  frame_ = 0;
  held_ = Button::kNone;
  for (int i = 0; i < no_op_frames; ++i) Frame(Button::kNone);
}

int BreakoutGame::Step(Button button) {
  int reward = 0;
  for (int i = 0; i < kFrameSkip && !over(); ++i) reward += Frame(button);
  return reward;
}

int BreakoutGame::Frame(Button button) {
  if (over()) return 0;
  if (options_.sticky <= 0.0 || Uniform(&random_) >= options_.sticky) held_ = button;
  MovePaddle(held_);
  int points = 0;
  if (state_.in_play) {
    MoveBall();
    points = BreakBrick();
    // The second wall appears when the paddle returns the ball.
    if (state_.cleared && state_.walls < 2 && TouchesPaddle()) {
      state_.bricks.set();
      state_.cleared = false;
      ++state_.walls;
    }
    if (state_.ball_y >= kPictureHeight) {
      --lives_;
      state_.in_play = state_.narrow = false;
      state_.armed = true;
      state_.hits = 0;
    }
  } else if (held_ == Button::kFire) {
    Serve();
  }
  score_ += points;
  ++frame_;
  return points;
}

void BreakoutGame::Serve() {
  const int place = static_cast<int>(frame_ % 4);
  state_.in_play = true;
  state_.ball_x = kServes[place];
  state_.ball_y = kServeY;
  state_.right = place % 2 == 0 ? 1 : -1;
  state_.down = 1;
  state_.speed = 0;
}

void BreakoutGame::MovePaddle(Button button) {
  const int direction = button == Button::kRight ? 1 : button == Button::kLeft ? -1 : 0;
  int& speed = state_.paddle_speed;
  const bool at_wall = state_.paddle_x <= kLeft || state_.paddle_x >= kPaddleEnd;
  // The gain of a press that reverses the paddle follows from the count of the presses before.
  const int gain = at_wall ? kGainsAtWall[state_.presses] : kGains[state_.presses];
  if (direction * speed < 0) {
    speed = 0;
    state_.presses = 0;
  } else if (direction == 0 || at_wall) {
    speed = Half(speed);
  }
  if (direction == 0) {
    state_.presses = 0;
  } else {
    speed = std::clamp(speed + direction * gain, -kPaddleSpeed, kPaddleSpeed);
    state_.presses = std::min(state_.presses + 1, kPresses - 1);
  }
  state_.paddle_x = std::clamp(state_.paddle_x + speed, kLeft, kPaddleEnd);
}

bool BreakoutGame::TouchesPaddle() const {
  const int bottom = state_.ball_y + kBallHeight, left = state_.ball_x - state_.paddle_x;
  const int width = state_.narrow ? kNarrowPaddleWidth : kPaddleWidth;
  if (left + kBallWidth < 0 || left > width) return false;
  if (bottom > kPaddleTop && bottom <= kPaddleTop + kPaddleHeight) return true;
  const bool beside = bottom >= kPaddleTop && state_.ball_y <= kPaddleTop + kPaddleHeight;
  return beside && (left + kBallWidth <= kNear || left >= width - kNear);
}

void BreakoutGame::LeavePaddle() {
  // Sections have the same width on the narrow paddle, which lacks the last one; beside them the
  // ball goes on as it was.
  const int left = state_.ball_x - state_.paddle_x;
  const int section = left * kSections / kPaddleWidth;
  if (left < 0 || section >= kSections) return;
  if (state_.speed != kNumSpeeds - 1) state_.speed = section == 0 || section == 4 ? 1 : 2;
  if (section != 2) state_.right = section < 2 ? -1 : 1;
  if (state_.down > 0) ++state_.hits;
  state_.down = -1;
}

void BreakoutGame::MoveBall() {
  // This is the velocity of the frame before.
  const int* speed = kSpeeds[state_.speed][(frame_ + 1) % 2];
  state_.ball_x += state_.right * speed[0];
  state_.ball_y += state_.down * speed[1];
  bool armed = false;
  if (state_.ball_x <= kLeft || state_.ball_x >= kRight - kBallWidth) {
    state_.ball_x = std::clamp(state_.ball_x, kLeft, kRight - kBallWidth);
    state_.right = -state_.right;
    armed = state_.ball_y < kBricksTop || state_.ball_y > kBricksTop + kRows * kBrickHeight;
  }
  if (state_.ball_y <= kTop) {
    state_.ball_y = kTop;
    state_.down = -state_.down;
    state_.narrow = armed = true;
  }
  if (TouchesPaddle()) {
    LeavePaddle();
    armed = true;
  }
  if (state_.hits >= kManyHits && state_.speed != kNumSpeeds - 1) state_.speed = kNumSpeeds - 2;
  state_.armed = state_.armed || armed;
}

int BreakoutGame::BreakBrick() {
  if (!state_.armed) return 0;
  for (int brick = 0; brick < kBricks; ++brick) {
    if (!state_.bricks[brick]) continue;
    const int row = brick / kColumns;
    const int x = kLeft + brick % kColumns * kBrickWidth;
    const int top = kBricksTop + row * kBrickHeight, bottom = top + kBrickHeight;
    if (state_.ball_x >= x + kBrickWidth || state_.ball_x + kBallWidth <= x ||
        state_.ball_y > bottom || state_.ball_y + kBallHeight < top ||
        std::abs(bottom - state_.ball_y) > kDeep) {
      continue;
    }
    state_.bricks[brick] = false;
    state_.cleared = state_.bricks.none();
    state_.armed = false;
    state_.down = -state_.down;
    if (row < kFastRows) state_.speed = kNumSpeeds - 1;
    return kPoints[row];
  }
  return 0;
}

void BreakoutGame::Draw(Picture* picture) const {
  std::fill(picture->pixels.begin(), picture->pixels.end(), 0);
  constexpr int kWallTop = 17;
  picture->Fill(0, kWallTop, kPictureWidth, kTop - kWallTop, kWallColour);
  picture->Fill(0, kTop, kLeft, kPictureHeight - kTop, kWallColour);
  picture->Fill(kRight, kTop, kPictureWidth - kRight, kPictureHeight - kTop, kWallColour);
  for (int brick = 0; brick < kBricks; ++brick) {
    if (!state_.bricks[brick]) continue;
    const int row = brick / kColumns;
    picture->Fill(kLeft + brick % kColumns * kBrickWidth, kBricksTop + row * kBrickHeight,
                  kBrickWidth, kBrickHeight, kRowColours[row]);
  }
  picture->Fill(state_.paddle_x, kPaddleTop, state_.narrow ? kNarrowPaddleWidth : kPaddleWidth,
                kPaddleHeight, kBallColour);
  if (state_.in_play) {
    picture->Fill(state_.ball_x, state_.ball_y, kBallWidth, kBallHeight, kBallColour);
  }
}

}  // namespace tangible
