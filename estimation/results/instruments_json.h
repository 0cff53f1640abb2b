// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The parts of a fit file that describe how observations were made: points, sensors, cameras,
// clocks and the list of observation files.

#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/scene/json_reader.h"

namespace tangible {

/// {"tip": {"body": "link9", "at": [0, -0.5]}}; none where it is absent. Errors go to the reader.
std::vector<BodyPoint> ReadPoints(const JsonReader& json, const Scene& scene);

/// The keys sensors, cameras and clocks of a fit file, each optional: objects by name.
Instruments ReadInstruments(const JsonReader& root, const Scene& scene,
                            const std::vector<BodyPoint>& points);

/// {"bounce": {"bodies": ["ball", "floor"], "kind": "touch"}}; none where it is absent.
std::vector<ObservedEvent> ReadEvents(const JsonReader& json, const Scene& scene);

/// One entry of `observations`: {"file", "sigma", "sensor", "camera", "clock", "relative_to",
/// "unwrap", "frame", "gravity"}.
struct ObservationEntry {
  std::string file;  ///< as written
  ObservationSigma sigma;
  ObservationOptions options;
};
ObservationEntry ReadObservationEntry(const JsonReader& json, const ObservedScene& scene);

}  // namespace tangible
