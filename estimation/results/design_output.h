// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Files of candidates for the next experiment, and what is written of them: part of the result, of
// the report and of what the terminal shows.

#include <string>
#include <vector>

#include "tangible/estimation/fit/design.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// Reads and checks a request for a fit. False with one line "file: /json/pointer: what, expected,
/// got".
bool ParseDesign(const std::string& text, const std::string& file, const FitInput& input,
                 const RecordingsProblem& problem, DesignRequest* request, std::string* error);

OrderedJson DesignToJson(const std::vector<ParameterEntry>& entries, const Design& design);

/// Of the report, in HTML.
std::string DesignPart(const std::vector<ParameterEntry>& entries, const Design& design);

/// Of the terminal: a line a candidate, which is best, and takes for the wanted widths.
std::string DescribeDesign(const std::vector<ParameterEntry>& entries, const Design& design);

/// What is wrong with the first candidate that cannot be run, or empty.
std::string FirstFailure(const Design& design);

}  // namespace tangible
