// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Files of event times: a table with the columns `time` (s), `event` (a name of the instruments'
// events) and `number` (an integer from 1: the first, second, ... in the run). The numbers of an
// event increase from row to row; those that were not recorded are left out.

#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/scene/csv.h"

namespace tangible {

/// As ReadObservations, of a table of events.
bool ReadEventTimes(const CsvTable& table, const ObservedScene& scene,
                    const ObservationSigma& sigma, const ObservationOptions& options,
                    std::vector<Channel>* channels, std::vector<Observation>* observations,
                    std::string* error);

}  // namespace tangible
