// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/detector.h"

#include <algorithm>
#include <cstring>

namespace tangible {
namespace {

constexpr int kLeastPaddle = 6;  // pixels; narrower runs are no paddle

// The longest run of pixels within [left, right) of a row that are not black.
Rectangle LongestRun(const Picture& picture, int y, int left, int right) {
  Rectangle best{0, y, 0, 1};
  for (int x = left; x < right;) {
    int end = x;
    while (end < right && picture.At(end, y) != 0) ++end;
    if (end - x > best.width) best = {x, y, end - x, 1};
    x = end + 1;
  }
  return best;
}

}  // namespace

bool Detector::Start(const Picture& picture) {
  arena_ = Arena();
  colours_.clear();
  drawn_.reset();
  const int middle = kPictureHeight / 2, centre = kPictureWidth / 2;
  const uint32_t wall = picture.At(0, middle);
  if (wall == 0) return false;
  while (arena_.left < kPictureWidth && picture.At(arena_.left, middle) == wall) ++arena_.left;
  arena_.right = kPictureWidth;
  while (arena_.right > arena_.left && picture.At(arena_.right - 1, middle) == wall) --arena_.right;
  while (arena_.top < middle && picture.At(centre, arena_.top) != wall) ++arena_.top;
  while (arena_.top < middle && picture.At(centre, arena_.top) == wall) ++arena_.top;
  if (arena_.top == middle || arena_.right - arena_.left < kBrickColumns) return false;
  // Rows of bricks, by their colours at the left wall.
  const int width = (arena_.right - arena_.left) / kBrickColumns;
  for (int y = arena_.top; y < middle;) {
    const uint32_t colour = picture.At(arena_.left, y);
    int end = y;
    while (end < middle && picture.At(arena_.left, end) == colour) ++end;
    for (int i = 0; colour != 0 && i < kBrickColumns; ++i) {
      arena_.bricks.push_back({arena_.left + i * width, y, width, end - y});
      colours_.push_back(colour);
    }
    y = end;
  }
  if (arena_.bricks.empty() || arena_.bricks.size() > kMostBricks) return false;
  // The paddle is the lowest wide object.
  int bottom = kPictureHeight - 1;
  while (bottom > middle &&
         LongestRun(picture, bottom, arena_.left, arena_.right).width < kLeastPaddle) {
    --bottom;
  }
  paddle_ = LongestRun(picture, bottom, arena_.left, arena_.right);
  if (bottom == middle) return false;
  arena_.paddle_y = bottom;
  while (picture.At(paddle_.x, arena_.paddle_y - 1) == picture.At(paddle_.x, bottom)) {
    --arena_.paddle_y;
  }
  arena_.paddle_height = bottom + 1 - arena_.paddle_y;
  paddle_.y = arena_.paddle_y;
  paddle_.height = arena_.paddle_height;
  paddle_colour_ = picture.At(paddle_.x, bottom);
  background_ = Picture();
  background_.Fill(0, 0, kPictureWidth, kPictureHeight, wall);
  background_.Fill(arena_.left, arena_.top, arena_.right - arena_.left, kPictureHeight - arena_.top,
                   0);
  return true;
}

void Detector::FindBricks(const Picture& picture, Sight* sight) {
  for (size_t i = 0; i < arena_.bricks.size(); ++i) {
    const Rectangle& brick = arena_.bricks[i];
    // The ball hides at most one corner.
    int corners = 0;
    for (const int y : {brick.y, brick.y + brick.height - 1}) {
      for (const int x : {brick.x, brick.x + brick.width - 1}) {
        corners += picture.At(x, y) == colours_[i] ? 1 : 0;
      }
    }
    const bool stands = corners >= 3;
    sight->bricks[i] = stands;
    if (stands != drawn_[i]) {
      drawn_[i] = stands;
      background_.Fill(brick.x, brick.y, brick.width, brick.height, stands ? colours_[i] : 0);
    }
  }
}

void Detector::FindPaddle(const Picture& picture, Sight* sight) {
  // The ball may cover a part of the paddle, or appear to lengthen it at an end. Then its width is
  // the last one that was seen, and its place that of the middle row that the ball does not touch.
  Rectangle shortest{0, 0, kPictureWidth, 1};
  for (int y = arena_.paddle_y; y < arena_.paddle_y + arena_.paddle_height; ++y) {
    const Rectangle run = LongestRun(picture, y, arena_.left, arena_.right);
    if (run.width < shortest.width) shortest = run;
  }
  if (shortest.width < kLeastPaddle) return;
  sight->paddle_seen = true;
  sight->paddle = {shortest.x, arena_.paddle_y, shortest.width, arena_.paddle_height};
  if (shortest.width > paddle_.width && sight->bricks != Bricks() &&
      shortest.width <= paddle_.width + 2) {
    // If the paddle appears longer, the end that is nearer to its last place is kept.
    const int right = shortest.x + shortest.width - paddle_.width;
    if (std::abs(right - paddle_.x) < std::abs(shortest.x - paddle_.x)) sight->paddle.x = right;
    sight->paddle.width = paddle_.width;
  }
  paddle_ = sight->paddle;
}

void Detector::FindBall(const Picture& picture, Sight* sight) const {
  int left = kPictureWidth, right = -1, top = kPictureHeight, bottom = -1, count = 0;
  const Rectangle& paddle = sight->paddle;
  const size_t width = static_cast<size_t>(arena_.right - arena_.left) * sizeof(uint32_t);
  for (int y = arena_.top; y < kPictureHeight; ++y) {
    const uint32_t *seen = picture.Row(y), *expected = background_.Row(y);
    if (std::memcmp(seen + arena_.left, expected + arena_.left, width) == 0) continue;
    const bool at_paddle = sight->paddle_seen && y >= paddle.y && y < paddle.y + paddle.height;
    for (int x = arena_.left; x < arena_.right; ++x) {
      if (seen[x] == expected[x] || (at_paddle && x >= paddle.x && x < paddle.x + paddle.width)) {
        continue;
      }
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
      ++count;
    }
  }
  const int across = right + 1 - left, down = bottom + 1 - top;
  if (count == 0 || count != across * down) return;
  sight->ball = {left, top, across, down};
  // A part of the ball may be hidden by the paddle or below the picture; its upper left corner is
  // seen.
  const bool cut = bottom + 1 == paddle.y || bottom + 1 == kPictureHeight;
  sight->ball_seen = across == 2 && (down == 4 || (cut && down < 4));
}

Sight Detector::Look(const Picture& picture) {
  Sight sight;
  FindBricks(picture, &sight);
  FindPaddle(picture, &sight);
  FindBall(picture, &sight);
  return sight;
}

}  // namespace tangible
