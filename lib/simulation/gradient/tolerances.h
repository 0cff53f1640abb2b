// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the methods of gradients: of what each is a share, then why.
// lib/simulation/README.md has a table.

namespace tangible {

/// Of the parameter (or state, or control), at least its scale: of central differences: cube root
/// of ε, where the errors of truncation and rounding balance.
inline constexpr double kRelativeStep = 6e-6;
/// Of the parameter, at least its scale: first way of a one-sided derivative: beyond what contacts
/// hold to, and small against the next kink.
inline constexpr double kSideWay = 1e-5;
/// Of the largest entry: what both orders of extrapolation may differ by.
inline constexpr double kSidesConverged = 1e-6;
/// Of the change over the first way: what the integral of the derivative may miss: a touch at no
/// speed is located to 1e-7 m/s.
inline constexpr double kContinuous = 0.05;
/// Of the values: rounding, on top of the above.
inline constexpr double kValueRounding = 1e-11;
/// Of the values over the parameter's size: derivatives below it are 0.
inline constexpr double kNoDerivative = 1e-9;

}  // namespace tangible
