// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of recordings and studies. Each comment names the quantity of which the tolerance
// is a fraction or multiple, then the reason. The README has the table.

namespace tangible {

/// Absolute, s: a row whose time is beyond an end of the window by less belongs to the window,
/// because it differs by rounding.
inline constexpr double kWindowRounding = 1e-9;
/// Of an end of the window, beside kWindowRounding: the end and the scale of a table's times are
/// rounded to doubles, by a quarter of this each.
inline constexpr double kEndRounding = 4.5e-16;
/// Of the number, as a long double: units of a table's times in a second, and the first time in
/// them, that differ from a whole number by less are that number.
inline constexpr double kUnitRounding = 1e-18;
/// Absolute, s: a recording whose first time is later has the times of a clock that began
/// elsewhere (in 1970, or when the computer was started), and they are counted from its first one.
/// No run begins with three hours without a row.
inline constexpr double kClockTime = 1e4;
/// Of one sample: a number of samples that is smaller than a whole number by less is that whole
/// number.
inline constexpr double kSampleRounding = 1e-9;
/// Of the scale of a parameter: the step of central differences of derived quantities.
inline constexpr double kDerivedStep = 1e-6;
/// Of the true mass: a start whose masses all differ by less has reached the truth.
inline constexpr double kReachedTruth = 1e-8;

}  // namespace tangible
