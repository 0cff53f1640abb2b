// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A search for the first event of a scene.

#include <gtest/gtest.h>

#include <string>

#include "scenes.h"
#include "tangible/simulation/events/event_search.h"

namespace tangible::testing {

/// From a scene's start to its first event, or over `length`.
inline Segment FirstSegment(const std::string& text, double length, bool* found) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(text), &model, &state);
  EventSearch search(model);
  Segment segment;
  segment.length = length;
  segment.middle = 0.5 * length;
  segment.before = state;
  std::string message;
  *found = search.Run(model, {}, &segment, &message);
  EXPECT_TRUE(*found) << message;
  return segment;
}

/// A scene's settings.
inline std::string Simulation() {
  return R"("simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 1})";
}

}  // namespace tangible::testing
