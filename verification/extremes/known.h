// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The list of cases that are known not to hold: shown as such, they do not fail a run.

#include <string>
#include <vector>

#include "tangible/verification/extremes/extreme_case.h"

namespace tangible::extremes {

struct KnownCase {
  std::string name, stepping, reason;
};

const std::vector<KnownCase>& KnownCases();

/// Sets known_reason of the cases that are on the list.
void MarkKnown(std::vector<ExtremeCase>* cases);

}  // namespace tangible::extremes
