// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs cases, each in a separate process.

#include <functional>
#include <string>
#include <vector>

#include "tangible/verification/extremes/extreme_case.h"

namespace tangible::extremes {

/// kKnown: a bound does not hold, and the case is on the list of those that are known not to.
/// kFailed: any other, also of a case that did not end (`message` says why).
enum class Verdict { kHolds, kKnown, kFailed };

/// "holds", "known", "fails".
const char* NameOf(Verdict verdict);

struct CaseResult {
  std::string group, name, stepping, known_reason;
  Finding finding;
  std::string message;   ///< not empty: the case did not end
  double seconds = 0.0;  ///< CPU time
  Verdict verdict() const;
};

struct RunOptions {
  Length length = Length::kShort;
  int threads = 1;  ///< processes at the same time
};

CaseResult RunCase(const ExtremeCase& extreme_case, Length length);

/// All of them; results in the order of the cases. `progress` is called after each, with the
/// number that is done.
std::vector<CaseResult> RunCases(const std::vector<ExtremeCase>& cases, const RunOptions& options,
                                 const std::function<void(long done)>& progress);

}  // namespace tangible::extremes
