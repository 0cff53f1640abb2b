// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Coloured discs in a box that is shown in pictures of 64 x 64 pixels. Lengths are in pixels and
// times in frames: x runs along a row of the picture and y down its columns, and the pixel in
// column i and row j has its centre at (i + 1/2, j + 1/2).
//
// A state of n discs is (n, 4): x, y, vx, vy of each. Discs are without friction and do not turn.

#include <array>
#include <string>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

inline constexpr int kPictureSize = 64;
inline constexpr int kPicturePixels = kPictureSize * kPictureSize;
/// The number of bytes of a picture: three planes (red, green, blue) of rows.
inline constexpr int kPictureBytes = 3 * kPicturePixels;

using Colour = std::array<double, 3>;  ///< red, green, blue, in [0, 1]

enum class DiscStyle {
  kAntiAliased,  ///< the share of the pixel that the disc covers, over the cloth
  kSoft,         ///< SimB: exp(−(d² / r²)⁴) at the pixel's centre, added up, at most 1
};

struct DiscWorld {
  DiscStyle style = DiscStyle::kAntiAliased;
  double low = 0.0, high = kPictureSize;  ///< walls, of both coordinates
  Colour cloth{0.0, 0.0, 0.0};
  std::vector<Colour> colours{};  ///< a disc each
  std::vector<double> radii{};    ///< pixels
  std::vector<double> masses{};   ///< kg
  double disc_restitution = 1.0;
  double side_restitution = 1.0;  ///< left and right wall
  double end_restitution = 1.0;   ///< upper and lower wall
  double linear_damping = 0.0;    ///< of each disc, kg a frame: friction of the cloth

  int size() const { return static_cast<int>(radii.size()); }
};

/// Three discs of radius 5 and masses 1, 2 and 0.5 kg that lose speed on the cloth, between two
/// elastic and two inelastic walls.
DiscWorld BilliardWorld();

/// Three equal elastic discs of radius 2, as in RPIN's SimB (Sutskever's bouncing balls).
DiscWorld SimbWorld();

/// The world as a scene with event stepping and one step for each frame. Its bodies are disc0,
/// disc1, ..., side_left, side_right, end_top and end_bottom; its pairs disc0:disc1,
/// disc0:side_left, ... have the restitutions.
Scene SceneOf(const DiscWorld& world, int frames);

/// A picture of discs whose centres are (x0, y0, x1, y1, ...): kPictureBytes.
std::string DrawDiscs(const DiscWorld& world, const std::vector<double>& centres);

}  // namespace tangible
