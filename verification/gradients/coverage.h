// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The features that occurred in a set of scenes, so that a check of random scenes can report what
// it has not checked.

#include <map>
#include <string>
#include <vector>

#include "tangible/verification/support/trace.h"

namespace tangible {

/// How many scenes had each feature: "contact circle, box" (closed in some step), "joint weld",
/// "mixing of friction minimum", "friction sticking", "bodies 3", ...
using Coverage = std::map<std::string, long>;

/// The coverage of one scene and its run: 1 for each feature.
Coverage CoverageOf(const Scene& scene, const RunTrace& run);

/// sum += one.
void Add(const Coverage& one, Coverage* sum);

/// How the names of coincidences (support/coincidences.h) begin.
inline constexpr char kCoincidencePrefix[] = "coincidence: ";
/// Whether any of the scenes was one.
bool HasCoincidences(const Coverage& coverage);

/// Everything that random scenes are meant to have.
std::vector<std::string> ExpectedCoverage();

/// Those of ExpectedCoverage that are missing, and of CoincidenceKinds if there were
/// coincidences.
std::vector<std::string> MissingCoverage(const Coverage& coverage);

}  // namespace tangible
