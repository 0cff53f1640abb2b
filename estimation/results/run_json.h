// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The parts of a fit file that describe one run (README.md of estimation has the keys).

#include <limits>
#include <string>

#include "tangible/estimation/fit/fit.h"
#include "tangible/scene/json_reader.h"

namespace tangible {

/// The part of a recording that is used: observations from `start`, the run's time 0, to `end`; s.
struct RecordingPart {
  double start = 0.0;
  double end = std::numeric_limits<double>::infinity();
};

/// One run from JSON, with its scene and that part of its observations. `name` begins messages,
/// each "name: /json/pointer: what, expected, got"; files are looked for in `folder`. Keys that a
/// file has for all its recordings (`recordings`, and of parameters `per` and `varies`) are left
/// out.
bool ReadRun(const Json& json, const std::string& name, const std::string& folder,
             const RecordingPart& part, FitProblem* problem, std::string* error);

/// "gaussian": the kind of a prior or spread of which `json` is the object {kind: ...}; false, with
/// the error kept there, where it has none or two. `of` ends the message about unknown keys.
bool ReadDistribution(const JsonReader& json, const std::string& of, PriorKind* kind);

/// One line about a fault of a parameter, with its JSON pointer after `name`.
std::string DescribeFault(const std::string& name, const ParameterError& fault);

}  // namespace tangible
