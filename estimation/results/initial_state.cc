// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/initial_state.h"

#include <Eigen/QR>
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace tangible {
namespace {

// The number is small, so that an impact is unlikely between the samples.
constexpr size_t kSamples = 5;

struct Wanted {
  int body = -1;
  Coordinate coordinate = Coordinate::kX;
  bool is_rate = false;
};

// bodies/NAME/velocity/x and the like.
std::optional<Wanted> Parse(const Scene& scene, const std::string& path) {
  constexpr std::pair<const char*, std::pair<Coordinate, bool>> kEnds[] = {
      {"/position/x", {Coordinate::kX, false}}, {"/position/y", {Coordinate::kY, false}},
      {"/angle", {Coordinate::kAngle, false}},  {"/velocity/x", {Coordinate::kX, true}},
      {"/velocity/y", {Coordinate::kY, true}},  {"/angular_velocity", {Coordinate::kAngle, true}}};
  for (size_t body = 0; body < scene.bodies.size(); ++body) {
    for (const auto& [end, what] : kEnds) {
      if (path == "bodies/" + scene.bodies[body].name + end) {
        return Wanted{static_cast<int>(body), what.first, what.second};
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> InitialFromObservations(const FitProblem& problem,
                                              const FitParameter& parameter) {
  if (parameter.sets.size() != 1 || parameter.sets[0].mode != SetMode::kAssign) return std::nullopt;
  const std::optional<Wanted> wanted = Parse(problem.scene, parameter.sets[0].path);
  if (!wanted) return std::nullopt;
  std::vector<const Observation*> samples;
  for (const Observation& observation : problem.observations) {
    const Channel channel =
        problem.channels.empty() ? Channel{} : problem.channels[observation.channel];
    const bool direct = channel.sensor < 0 && channel.camera < 0 && channel.clock < 0 &&
                        channel.to_body < 0 && observation.point < 0;
    if (direct && observation.body == wanted->body &&
        observation.coordinate == wanted->coordinate) {
      samples.push_back(&observation);
    }
  }
  std::stable_sort(samples.begin(), samples.end(),
                   [](const auto* a, const auto* b) { return a->time < b->time; });
  samples.resize(std::min(samples.size(), kSamples));
  if (samples.size() < (wanted->is_rate ? 2U : 1U)) return std::nullopt;
  const auto rows = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd terms(rows, std::min<Eigen::Index>(rows, 3));
  Eigen::VectorXd values(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Observation& sample = *samples[static_cast<size_t>(i)];
    double power = 1.0 / sample.sigma;
    for (Eigen::Index j = 0; j < terms.cols(); ++j, power *= sample.time) terms(i, j) = power;
    values[i] = sample.value / sample.sigma;
  }
  const Eigen::VectorXd found = terms.colPivHouseholderQr().solve(values);
  const double value = found[wanted->is_rate ? 1 : 0];
  const ParameterSet& set = parameter.sets[0];
  double start = (value - set.offset) / set.scale;
  if (parameter.lower) start = std::max(start, *parameter.lower);
  if (parameter.upper) start = std::min(start, *parameter.upper);
  return start;
}

}  // namespace tangible
