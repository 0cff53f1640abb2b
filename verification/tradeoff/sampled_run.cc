// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/sampled_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/settings.h"

namespace tangible::tradeoff {
namespace {

// Memory of the adjoint's records; if they would take more, steps are run again, as in a user's
// program.
constexpr size_t kTapeBytes = size_t{512} << 20;

// The poses at the samples; a message or empty.
std::string Sample(const Scene& scene, int samples, SampledRun* run) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const std::vector<int>& moving = model.structure->moving;
  const long every = std::max(1L, NumSteps(scene.simulation) / samples);
  const RolloutReport report = Rollout(
      model, state,
      [&](long k, double, const State<double>& now, Stepper*) {
        if (k % every != 0) return;
        for (const int body : moving) {
          for (int i = 0; i < 3; ++i) run->poses.push_back(now.pose[3 * body + i]);
        }
      },
      &state);
  run->steps = report.steps;
  return report.message;
}

}  // namespace

SampledRun RunSampled(const Scene& scene, const std::vector<ParameterPath>& parameters,
                      GradientMethod method, const SampleOptions& options) {
  SampledRun run;
  if (!CheckSettings(scene, &run.message)) return run;
  run.message = Sample(scene, options.samples, &run);
  if (!run.done()) return run;
  GradientOptions gradient;
  gradient.method = method;
  gradient.certificate = CertificatePass::kSkip;
  gradient.checkpointing = {Checkpointing::Kind::kBudget, 0, kTapeBytes};
  GradientResult result = FinalStateJacobian(scene, parameters, gradient);
  run.message = result.message;
  if (!run.done()) return run;
  const double once = result.seconds + result.rollout_seconds;
  const double fits = options.repeat_seconds / std::max(once, 1e-9);
  if (fits >= 1.0) {
    gradient.repeat = static_cast<int>(std::min<double>(options.most_repeats, fits));
    result = FinalStateJacobian(scene, parameters, gradient);
  }
  run.run_seconds = result.all_rollout_seconds;
  run.both_seconds = result.all_seconds;
  run.jacobian = std::move(result.jacobian);
  return run;
}

ErrorScale ScaleOf(const Scene& scene, const std::vector<ParameterPath>& parameters,
                   const SampledRun& reference) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  ErrorScale scale;
  scale.duration = scene.simulation.duration;
  for (const int body : model.structure->moving) {
    const BodyIndex& index = model.structure->bodies[body];
    scale.gyration.push_back(
        std::sqrt(model.parameters[index.inertia] / model.parameters[index.mass]));
  }
  for (const ParameterPath& parameter : parameters) scale.parameters.push_back(parameter.scale);
  double low[2] = {HUGE_VAL, HUGE_VAL};
  double high[2] = {-HUGE_VAL, -HUGE_VAL};
  for (size_t i = 0; i + 2 < reference.poses.size(); i += 3) {
    for (size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], reference.poses[i + axis]);
      high[axis] = std::max(high[axis], reference.poses[i + axis]);
    }
  }
  scale.length = scale.gyration.empty()
                     ? 1.0
                     : std::max(std::hypot(high[0] - low[0], high[1] - low[1]),
                                *std::max_element(scale.gyration.begin(), scale.gyration.end()));
  return scale;
}

double TrajectoryError(const ErrorScale& scale, const SampledRun& run,
                       const SampledRun& reference) {
  const size_t bodies = scale.gyration.size();
  if (run.poses.size() != reference.poses.size()) return HUGE_VAL;
  double worst = 0.0;
  for (size_t i = 0; i + 2 < run.poses.size(); i += 3) {
    const auto apart = [&](size_t k) { return run.poses[i + k] - reference.poses[i + k]; };
    const double turned = scale.gyration[i / 3 % bodies] * apart(2);
    const double error = std::hypot(apart(0), apart(1), turned) / scale.length;
    worst = std::isnan(error) ? HUGE_VAL : std::max(worst, error);
  }
  return worst;
}

double GradientError(const ErrorScale& scale, const SampledRun& run, const SampledRun& reference) {
  double apart = 0.0;
  double size = 0.0;
  for (Eigen::Index i = 0; i < reference.jacobian.rows(); ++i) {
    const auto component = static_cast<int>(i % 6);  // x, y, angle, vx, vy, omega
    double weight = component < 3 ? 1.0 : scale.duration;
    if (component % 3 == 2) weight *= scale.gyration[static_cast<size_t>(i / 6)];
    for (Eigen::Index k = 0; k < reference.jacobian.cols(); ++k) {
      const double unit = weight * scale.parameters[static_cast<size_t>(k)] / scale.length;
      const double difference = unit * (run.jacobian(i, k) - reference.jacobian(i, k));
      apart = std::hypot(apart, difference);
      size = std::hypot(size, unit * reference.jacobian(i, k));
    }
  }
  if (size == 0.0) return std::numeric_limits<double>::quiet_NaN();
  return std::isnan(apart) ? HUGE_VAL : apart / size;
}

}  // namespace tangible::tradeoff
