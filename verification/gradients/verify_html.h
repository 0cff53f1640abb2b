// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a verification: one self-contained HTML page for readers.

#include <string>

#include "tangible/verification/gradients/verify_run.h"

namespace tangible {

/// How dark a cell of the heat map is, in [0, 1], by the largest error over the bound: 0 at 1e-8 of
/// it and below, 1 at the bound.
double HeatOf(double error_over_bound);

/// Bounds, the heat map (a column for each scene, a row for each pair of methods), kinds of
/// parameters, the worst entries with their scenes, exceptions. `origin` says where the figures
/// come from; `verdict` is empty if every bound holds.
std::string VerifyReport(const VerifyResult& result, const std::string& origin,
                         const std::string& verdict);

}  // namespace tangible
