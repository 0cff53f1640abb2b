// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Shards of tangible-fit (app/shards.h). Rows are the chains of --posterior, around the estimate
// that each shard finds for itself; without it the starts where there are several, else the
// profiles that --profile names. What follows them, the estimate and all that is said of it, is
// made by --merge: some runs at one point, after chains the fit.

#include <functional>
#include <string>
#include <vector>

#include "tangible/app/shards.h"
#include "tangible/estimation/fit/fit_parts.h"

namespace tangible {

/// The chains of a fit, and what makes some of them: none where there is no estimate, or no density
/// to be sampled, which the merge says.
struct ChainsOfFit {
  int count = 0;
  std::function<std::vector<FinishedChain>(const std::vector<int>& numbers)> make;
};

/// Makes the rows of a shard and writes them to `out`. Returns what is wrong or empty: there is
/// nothing to divide, the file cannot be written.
std::string WriteFitShard(const FitOptions& options, const ChainsOfFit& chains,
                          const ShardPlan& plan, const std::string& out,
                          RecordingsProblem* problem);

/// Reads the rows of all shards for a fit to take over; what is wrong or empty.
std::string MergeFitShards(const FitOptions& options, int chains, const ShardPlan& plan,
                           FitParts* parts);

}  // namespace tangible
