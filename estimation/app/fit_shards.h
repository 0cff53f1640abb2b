// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Shards of tangible-fit (app/shards.h). Rows are the starts where there are several, else the
// profiles that --profile names. What follows them, the estimate and all that is said of it, is
// made by --merge: some runs at one point.

#include <string>

#include "tangible/app/shards.h"
#include "tangible/estimation/fit/fit_parts.h"

namespace tangible {

/// Makes the rows of a shard and writes them to `out`. Returns what is wrong or empty: there is
/// nothing to divide, the file cannot be written.
std::string WriteFitShard(const FitOptions& options, const ShardPlan& plan, const std::string& out,
                          RecordingsProblem* problem);

/// Reads the rows of all shards for a fit to take over; what is wrong or empty.
std::string MergeFitShards(const FitOptions& options, const ShardPlan& plan, FitParts* parts);

}  // namespace tangible
