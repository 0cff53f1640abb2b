// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The active-set polish: from a nearly solved LCP to machine precision.
//
// Row i is active (sᵢ = 0) where zᵢ / ζᵢ > sᵢ / σᵢ (problem.h), else inactive (zᵢ = 0). The
// equality system of these modes is solved for the *correction* of the given point, of least norm
// where rows are redundant, so that impulses which are not unique stay near the given, non-negative
// ones (the impulses of minimum norm can be negative although the modes are right). Rows with a
// wrong sign change their mode, a bounded number of times.

#include <vector>

#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"

namespace tangible {

/// The modes read from a point; no row counts as a kink.
std::vector<RowMode> IdentifyModes(const MixedLcp<double>& problem, const LcpVector& point);

/// Returns the point of the least scaled residual among the given one (with negative z set to 0)
/// and those visited. Cost: one factorisation for each visited set of modes, at most `max_rounds`.
LcpVector Polish(const MixedLcp<double>& problem, const LcpVector& point, int max_rounds = 30);
/// The same, beginning with the given modes: for example those of a basis, where the point is too
/// close to a change of modes to read them from it.
LcpVector Polish(const MixedLcp<double>& problem, const LcpVector& point, int max_rounds,
                 std::vector<RowMode> modes);

/// Looks in all 2ⁿ sets of modes, nz ≤ kMaxEnumeratedRows, for v, y and z, s ≥ 0 that satisfy the
/// equations (nnls.h; also where rows are redundant), until one is a solution to `tolerance`;
/// returns the best point.
inline constexpr int kMaxEnumeratedRows = 12;
LcpVector EnumerateModes(const MixedLcp<double>& problem, double tolerance);

}  // namespace tangible
