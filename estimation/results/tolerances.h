// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of results. Each comment names the quantity of which the tolerance is a fraction
// or multiple, then the reason. The README has the table.

namespace tangible {

/// Of the standard deviation of a series by its median, at least sigma: larger residuals are listed
/// as outliers.
inline constexpr double kOutlierDeviations = 5.0;
/// Of the width of a bin: a time that is beyond the end of a bin by less belongs to it, because it
/// differs by rounding.
inline constexpr double kEdgeRounding = 1e-9;
/// Of the largest of the start's derivatives: smaller ones make no motion of their own.
inline constexpr double kStateRank = 1e-9;
/// Of the largest value of a quantity: with a smaller range it does not move, and residuals are not
/// tested against it.
inline constexpr double kNoRange = 1e-6;

}  // namespace tangible
