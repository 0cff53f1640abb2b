// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the programs. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. The README has a table.

namespace tangible {

/// Of the largest entry of M: M counts as symmetric, because files have rounded decimals.
inline constexpr double kSymmetric = 1e-9;
/// Of the number of rows times the largest eigenvalue: smaller eigenvalues count as 0.
inline constexpr double kDefiniteRounding = 1e-15;
/// Of a step: the times in a table of controls may be off by it, as they are written in decimals.
inline constexpr double kSameStep = 1e-6;
/// Of 1, where model and noise are what they are said to be: a run whose observations surprise its
/// filter by more in the mean says so; of hundreds of numbers the mean is within some tenths.
inline constexpr double kSurprising = 2.0;

}  // namespace tangible
