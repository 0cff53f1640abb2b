// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Scenes of any size for benchmarks: discs in a box, separate piles, pyramids of boxes, chains.

#include "tangible/scene/scene.h"

namespace tangible {

/// The static bodies in a scene of discs: half-planes for one pile, thin boxes between several.
struct DiscPile {
  int columns;
  double width;  ///< of the inside, m
};
/// The box for n discs: ⌈√n⌉ columns of 0.25 m.
DiscPile PileOf(int discs);
/// Where disc i of a pile starts, m from the middle of its floor.
Vector2<double> DiscStart(const DiscPile& pile, int i);

/// n discs (radius 0.1 m, 1 kg, μ 0.5) that fall into a box; dt 2 ms.
Scene DiscsScene(int discs);
/// `piles` separate boxes of `discs` discs each, on one floor.
Scene PilesScene(int piles, int discs);
/// Unit boxes (1 kg, μ 0.5) in rows of base, base − 1, ... 1, a little apart; dt 1/60 s.
Scene PyramidScene(int base);
/// A ball (radius 0.1 m, 1 kg, 4 m/s) hits a hanging chain of links of 0.3 m and 1 kg; dt 2 ms.
Scene ChainScene(int links);

}  // namespace tangible
