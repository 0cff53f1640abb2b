// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The values that a number in a scene may have.

namespace tangible {

/// It determines the values that a file may contain, the bounds of a fit and the step of finite
/// differences.
enum class NumberKind {
  kFree,         ///< any finite number (positions, velocities, angles, ...)
  kPositive,     ///< > 0 (mass, inertia, radius, size, ...)
  kNonNegative,  ///< ≥ 0 (friction, damping, stiffness, ...)
  kFraction,     ///< in [0, 1] (restitution)
};

/// Whether a number of this kind may be `value`; false for infinities and NaN.
bool IsAllowed(NumberKind kind, double value);

/// For messages: "a number > 0" and the like.
const char* Describe(NumberKind kind);

}  // namespace tangible
