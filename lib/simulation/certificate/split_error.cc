// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/split_error.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/segment_flow.h"

namespace tangible {

double SplitError(const Model<double>& model, const Segment& segment) {
  SegmentFlow flow(model);
  std::string message;
  Segment whole;
  whole.time = segment.time;
  whole.middle = segment.middle;
  whole.before = segment.before;
  whole.contacts = segment.contacts;
  whole.friction = segment.friction;
  whole.modes = segment.modes;
  whole.length = 0.5 * segment.length;
  Segment half = whole;
  whole.length = segment.length;
  if (!flow.Run(model, &whole, &message) || !flow.Run(model, &half, &message)) {
    return 0.0;
  }
  Segment rest = half;
  rest.time += half.length;
  rest.before = half.after;
  if (!flow.Run(model, &rest, &message)) {
    return 0.0;
  }
  // Forces that friction cancels leave rounding of what they would move.
  double pull = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  const ContactProblem<double>& problem = whole.stages[0].problem;
  for (size_t i = 0; i < problem.load.size(); ++i) {
    pull = std::max(pull, std::abs(problem.load[i]) / problem.mass[i]);
  }
  const auto share = [&](const std::vector<double>& before, const std::vector<double>& one,
                         const std::vector<double>& two) {
    double apart = 0.0;
    double moved = 0.0;
    for (size_t i = 0; i < one.size(); ++i) {
      apart = std::max(apart, std::abs(one[i] - two[i]));
      moved = std::max({moved, std::abs(one[i] - before[i]), kAtRest * std::abs(one[i])});
    }
    return apart > 0.0 ? apart / (moved + kAtRest * pull * segment.length) : 0.0;
  };
  return std::max(share(segment.before.pose, whole.after.pose, rest.after.pose),
                  share(segment.before.twist, whole.after.twist, rest.after.twist));
}

}  // namespace tangible
