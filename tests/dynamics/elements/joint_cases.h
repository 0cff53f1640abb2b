// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A joint of each type between two bodies at general poses.

#include <cmath>
#include <vector>

#include "tangible/dynamics/elements/joint.h"

namespace tangible::testing {

inline constexpr JointType kTypes[] = {JointType::kRevolute, JointType::kPrismatic,
                                       JointType::kWeld, JointType::kDistance,
                                       JointType::kFixedAngle};
/// x, y and angle of the first and of the second body.
inline constexpr double kPoses[6] = {0.3, -0.2, 0.7, -0.4, 0.5, -1.1};

/// The numbers of a joint's geometry by type; the axis is a unit vector of b's frame.
inline std::vector<double> Geometry(JointType type) {
  switch (type) {
    case JointType::kPrismatic:
      return {0.11, -0.23, 0.31, 0.17, std::cos(0.6), std::sin(0.6), 0.4};
    case JointType::kFixedAngle:
      return {0.4};
    default:
      return {0.11, -0.23, 0.31, 0.17, 0.4};
  }
}

}  // namespace tangible::testing
