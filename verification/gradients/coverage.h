// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a set of scenes had in it: so that a check of random scenes can say what it has not checked.

#include <map>
#include <string>
#include <vector>

#include "tangible/verification/support/trace.h"

namespace tangible {

/// How many scenes had each thing: "contact circle, box" (closed in some step), "joint weld",
/// "mixing of friction minimum", "friction sticking", "bodies 3", ...
using Coverage = std::map<std::string, long>;

/// Of one scene and its run: 1 a thing.
Coverage CoverageOf(const Scene& scene, const RunTrace& run);

/// sum += one.
void Add(const Coverage& one, Coverage* sum);

/// Everything that random scenes are meant to have.
std::vector<std::string> ExpectedCoverage();

/// Those of ExpectedCoverage that are not there.
std::vector<std::string> MissingCoverage(const Coverage& coverage);

}  // namespace tangible
