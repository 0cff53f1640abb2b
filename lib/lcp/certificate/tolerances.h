// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of certificates. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. lib/lcp/README.md has the table.

namespace tangible {

/// Of the scale of the row: margins below it are reported as near a kink.
inline constexpr double kNearKinkMargin = 1e-6;
/// Of the largest entry: derivatives whose tangent and adjoint differ by more are not trustworthy:
/// the error of an entry may be ten times the difference of the whole, and each entry has to be
/// right to 1e-9.
inline constexpr double kLinearResidualLimit = 1e-10;

}  // namespace tangible
