// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Costs as a table, as JSON and as a picture.

#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/verification/cost/cost_bounds.h"

namespace tangible::cost {

/// A block for each number of steps: a line for each method, a column for each number of
/// parameters; each cell has the time in rollouts and the peak memory.
std::string TableText(const std::vector<CostCell>& cells);
std::string CrossoverText(const std::vector<Crossover>& crossovers);
std::string BoundsText(const std::vector<CheckedBound>& bounds);

OrderedJson ToJson(const std::vector<CostCell>& cells, const CostCell& long_run,
                   const std::vector<Crossover>& crossovers,
                   const std::vector<CheckedBound>& bounds);

/// SVG: time over the number of parameters, for runs of the second largest number of steps (or of
/// the only one), and memory over the number of steps, for the least number of parameters.
std::string Picture(const std::vector<CostCell>& cells);

}  // namespace tangible::cost
