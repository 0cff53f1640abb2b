// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random scenes of many bodies that press on each other: piles that fall, that a paddle stirs, that
// a press squeezes and releases, and walls of bricks whose sides touch.

#include <cstdint>
#include <string>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible::corpus {

/// "fall", "stir", "squeeze", "bricks".
const std::vector<std::string>& CrowdKinds();

/// The scene of that number and kind (an index into CrowdKinds), with 20 to `most_bodies` discs,
/// boxes or capsules, or all of them; friction of 0 to 1, restitution of 0 to 0.9, `steps` steps of
/// 2, 5 or 10 ms. In half of the scenes friction and restitution are round numbers, and angles 0.
Scene CrowdScene(std::uint64_t seed, int number, int kind, int most_bodies, int steps);

}  // namespace tangible::corpus
