// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of plots. Each comment names the quantity of which the tolerance is a fraction,
// then the reason. The README has a table.

namespace tangible {

/// Of the largest value: values that differ by less are drawn as one value, so that a plot does not
/// show rounding.
inline constexpr double kOneValue = 1e-12;
/// Of the step, range or power of ten of an axis: rounding of a quotient must not turn a tick of
/// 0.2 into one of 0.5, nor lose one at an end.
inline constexpr double kTickRounding = 1e-9;

}  // namespace tangible
