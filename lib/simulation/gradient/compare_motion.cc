// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/compare_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {
namespace {

// `values`: the size of what is differentiated. What is next to nothing of it over the size of a
// parameter is rounding.
void Compare(const RowMatrixXd& map, const RowMatrixXd& motion, double values,
             const std::vector<ParameterPath>& parameters, MotionComparison* comparison) {
  for (Eigen::Index j = 0; j < map.cols(); ++j) {
    const ParameterPath& parameter = parameters[static_cast<size_t>(j)];
    const double least = values / std::max(std::abs(parameter.value), parameter.scale);
    const double largest =
        std::max({map.col(j).cwiseAbs().maxCoeff(), motion.col(j).cwiseAbs().maxCoeff(), least});
    for (Eigen::Index i = 0; i < map.rows(); ++i) {
      const double size = std::max(std::abs(map(i, j)), std::abs(motion(i, j)));
      const double difference = std::abs(map(i, j) - motion(i, j)) / size;
      if (size <= kNoEntry * largest || !(difference > comparison->difference_max)) continue;
      comparison->difference_max = difference;
      comparison->parameter = parameter.path;
      if (!comparison->motion.outputs.empty() && comparison->motion.gradient.size() == 0) {
        comparison->output = comparison->motion.outputs[i];
      }
    }
  }
}

}  // namespace

Scene ByEvents(const Scene& scene) {
  Scene events = scene;
  events.simulation.stepping = Stepping::kEvent;
  events.simulation.integrator.reset();
  events.simulation.joint_correction.reset();
  return events;
}

MotionComparison CompareWithMotion(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                   const std::vector<LossTerm>& terms,
                                   const GradientOptions& options, const GradientResult& result) {
  MotionComparison comparison;
  GradientOptions same = options;
  same.method = result.method;
  same.repeat = 1;
  const Scene events = ByEvents(scene);
  comparison.motion = terms.empty() ? FinalStateJacobian(events, parameters, same)
                                    : LossGradient(events, parameters, terms, same);
  comparison.done = comparison.motion.done;
  comparison.message = comparison.motion.message;
  if (!comparison.done) return comparison;
  if (terms.empty()) {
    const double values = comparison.motion.values.cwiseAbs().maxCoeff();
    Compare(result.jacobian, comparison.motion.jacobian, values, parameters, &comparison);
  } else {
    Compare(result.gradient.transpose(), comparison.motion.gradient.transpose(),
            std::abs(comparison.motion.loss), parameters, &comparison);
  }
  return comparison;
}

}  // namespace tangible
