// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What is written of random forces: part of the result, of the report and of what the terminal
// shows.

#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/variance_components.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// Of each force what is known of its intensity, and its course in each recording.
OrderedJson ProcessNoiseToJson(const VarianceComponents& components);
/// Of each recording the smoothed states.
OrderedJson SmoothedStatesToJson(const VarianceComponents& components);

/// Of the report, in HTML: the forces over time, and over the coordinate and its rate, where a
/// dependence that the model misses shows.
std::string ProcessNoisePart(const VarianceComponents* components);

/// What of options that assume a run without random forces is asked for beside them ("--design: not
/// with process_noise"), or empty.
std::string RefusedWithNoise(const RecordingsProblem& problem,
                             const std::vector<std::pair<const char*, bool>>& asked);

/// Of the terminal: a line a force.
std::string DescribeProcessNoise(const VarianceComponents& components);

}  // namespace tangible
