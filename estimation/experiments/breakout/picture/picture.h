// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The interface between a game and its player: pictures from the game, buttons to it.

#include <array>
#include <cstdint>
#include <vector>

namespace tangible {

inline constexpr int kPictureWidth = 160;   ///< pixels
inline constexpr int kPictureHeight = 210;  ///< pixels
/// A button is held for this number of frames, at 60 a second, of which the last one is seen.
inline constexpr int kFrameSkip = 4;

/// 0xRRGGBB of each pixel, row by row from the top left.
struct Picture {
  std::vector<uint32_t> pixels =
      std::vector<uint32_t>(static_cast<size_t>(kPictureWidth) * kPictureHeight, 0);

  const uint32_t* Row(int y) const {
    return pixels.data() + static_cast<size_t>(y) * kPictureWidth;
  }
  uint32_t* Row(int y) { return pixels.data() + static_cast<size_t>(y) * kPictureWidth; }
  uint32_t At(int x, int y) const { return Row(y)[x]; }
  /// Fills the part of the rectangle that is within the picture.
  void Fill(int x, int y, int width, int height, uint32_t colour) {
    for (int j = y < 0 ? 0 : y; j < y + height && j < kPictureHeight; ++j) {
      for (int i = x < 0 ? 0 : x; i < x + width && i < kPictureWidth; ++i) Row(j)[i] = colour;
    }
  }
};

enum class Button { kNone, kFire, kRight, kLeft };
inline constexpr std::array<Button, 4> kButtons = {Button::kNone, Button::kFire, Button::kRight,
                                                   Button::kLeft};

}  // namespace tangible
