// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the methods of gradients. Each comment names the quantity of which the
// tolerance is a fraction, then the reason. lib/simulation/README.md has the table.

namespace tangible {

/// Of the parameter (or state, or control), at least its scale: the step of central differences,
/// the cube root of ε, where the errors of truncation and rounding balance.
inline constexpr double kRelativeStep = 6e-6;
/// Of the parameter, at least its scale: the first distance τ of a one-sided derivative: larger
/// than the tolerance of contacts, and small compared with the distance to the next kink.
inline constexpr double kSideWay = 1e-5;
/// Of the largest entry: the allowed difference between the two orders of extrapolation.
inline constexpr double kSidesConverged = 1e-6;
/// Of the change over the first distance: the allowed error of the integral of the derivative,
/// because a touch at zero speed is located to 1e-7 m/s.
inline constexpr double kContinuous = 0.05;
/// Of the values (over the parameter's size, of derivatives): rounding, added to both of the above.
inline constexpr double kValueRounding = 1e-11;
/// Of the values over the parameter's size: smaller derivatives count as 0.
inline constexpr double kNoDerivative = 1e-8;
/// Of the parameter's largest derivative: smaller ones are rounding where those of the map are
/// compared with those of the motion.
inline constexpr double kNoEntry = 1e-9;

}  // namespace tangible
