// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Results as a table, as JSON and as a page.

#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/verification/extremes/extreme_run.h"

namespace tangible::extremes {

struct Counts {
  long holds = 0, known = 0, failed = 0;
  long gradients = 0, trustworthy = 0;  ///< taken; of these, trustworthy
};
Counts Count(const std::vector<CaseResult>& results);

/// "302 cases: 300 hold, 2 known, 0 fail; ..."
std::string SummaryText(const Counts& counts);

/// A line for each case and stepping with the figure that is nearest its bound, the gradient's
/// columns and, where a bound does not hold, which one and why.
std::string TableText(const std::vector<CaseResult>& results);

OrderedJson ToJson(const std::vector<CaseResult>& results);

/// All figures, in a table for each group.
std::string Page(const std::vector<CaseResult>& results, const std::string& origin);

/// The first case that fails as one line, or empty.
std::string FirstFailure(const std::vector<CaseResult>& results);

}  // namespace tangible::extremes
