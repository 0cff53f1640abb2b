// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The model of a scene and the state in which it starts.

#include <string>

#include "scenes.h"
#include "tangible/dynamics/model/model.h"

namespace tangible::testing {

struct Built {
  Model<double> model;
  State<double> state;
};

/// Of a scene's text that is known to be good.
inline Built Build(const std::string& text) {
  Built built;
  BuildModel(test_scenes::SceneOf(text), &built.model, &built.state);
  return built;
}

}  // namespace tangible::testing
