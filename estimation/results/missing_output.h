// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What is written of what would explain the residuals: part of the result, of the report and of
// what the terminal shows.

#include <string>

#include "tangible/estimation/fit/missing.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// A row a candidate, or group of candidates that cannot be told apart.
OrderedJson MissingToJson(const MissingResult& missing);
/// How many were tested, what chance may explain, and the conclusion.
OrderedJson MissingSummaryToJson(const MissingResult& missing);

/// Of the report, in HTML.
std::string MissingPart(const MissingResult& missing);

/// Of the terminal: the table, and the conclusion.
std::string DescribeMissing(const MissingResult& missing);

}  // namespace tangible
