// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// When the bodies of a run by events are struck: there twists jump, and the derivatives of poses.

#include <vector>

#include "tangible/dynamics/model/model.h"

namespace tangible {

struct BodyImpact {
  int body = -1;
  double time = 0.0;  ///< s
};

/// The impacts of moving bodies in a run from `initial`, in the order of time; none by fixed steps,
/// and those before a failure where the run fails.
std::vector<BodyImpact> FindImpacts(const Model<double>& model, const State<double>& initial);

}  // namespace tangible
