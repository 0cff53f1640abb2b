// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the programs: of what each is a share, then why. The README has a table.

namespace tangible {

/// Of the largest entry of M: M is symmetric: files have rounded decimals.
inline constexpr double kSymmetric = 1e-9;
/// Of the number of rows times the largest eigenvalue: eigenvalues below it are 0.
inline constexpr double kDefiniteRounding = 1e-15;

}  // namespace tangible
