// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How far the derivative of a run by fixed steps is from that of the motion (discrete_map.h): the
// same scene by events, differentiated by the same method.

#include "tangible/simulation/gradient/gradient.h"

namespace tangible {

struct MotionComparison {
  bool done = false;
  std::string message;    ///< empty, or one line: why the motion has no derivative
  GradientResult motion;  ///< by events
  /// The largest |map − motion| / max(|map|, |motion|) of an entry, from 0 to 2: above 1 they have
  /// different signs. Entries that are rounding beside the others of their parameter do not count.
  double difference_max = 0.0;
  std::string output, parameter;  ///< of that entry; the output is empty for a loss, both if 0
};

/// The scene by events, with the integrator and the correction of joints that belong to them.
Scene ByEvents(const Scene& scene);

/// `result` is what FinalStateJacobian, or LossGradient where there are terms, gave with the same
/// arguments.
MotionComparison CompareWithMotion(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                   const std::vector<LossTerm>& terms,
                                   const GradientOptions& options, const GradientResult& result);

}  // namespace tangible
