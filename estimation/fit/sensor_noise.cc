// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/median.h"

namespace tangible {
namespace {

/// Σ r² of some rows, or its robust estimate with Huber's loss.
double SquareSum(const Eigen::VectorXd& residuals, const std::vector<int>& rows, double huber) {
  if (huber > 0.0 && !rows.empty()) {
    std::vector<double> sizes;
    sizes.reserve(rows.size());
    for (const int i : rows) {
      sizes.push_back(std::abs(residuals[i]));
    }
    const double deviation = kDeviationByMedian * UpperMedian(std::move(sizes));
    return static_cast<double>(rows.size()) * deviation * deviation;
  }
  double sum = 0.0;
  for (const int i : rows) {
    sum += residuals[i] * residuals[i];
  }
  return sum;
}

/// The entry of the sensor of this observation; null: its sigma is not estimated.
const SensorNoise* NoiseOf(const std::vector<SensorNoise>& noise, const Instruments& instruments,
                           const Channel& channel) {
  if (channel.sensor < 0 || !instruments.sensors[channel.sensor].estimate_sigma) {
    return nullptr;
  }
  for (const SensorNoise& one : noise) {
    if (one.name == instruments.sensors[channel.sensor].name) {
      return &one;
    }
  }
  return nullptr;
}

/// The rows of each sensor among the observations of all recordings.
std::vector<std::vector<int>> RowsOf(const RecordingsProblem& problem,
                                     const std::vector<SensorNoise>& noise) {
  std::vector<std::vector<int>> rows(noise.size());
  int row = 0;
  for (const RecordedRun& recording : problem.recordings()) {
    const RolloutResiduals& run = recording.residuals;
    for (const Observation& observation : run.observations()) {
      const SensorNoise* const one =
          NoiseOf(noise, run.scene().instruments(), run.ChannelOf(observation));
      if (one != nullptr) {
        rows[static_cast<size_t>(one - noise.data())].push_back(row);
      }
      ++row;
    }
  }
  return rows;
}

}  // namespace

std::vector<SensorNoise> SensorsToEstimate(const RecordingsProblem& problem) {
  std::vector<SensorNoise> noise;
  for (const RecordedRun& recording : problem.recordings()) {
    for (const Sensor& sensor : recording.residuals.scene().instruments().sensors) {
      const bool known = std::any_of(noise.begin(), noise.end(), [&sensor](const SensorNoise& one) {
        return one.name == sensor.name;
      });
      if (sensor.estimate_sigma && !known) {
        noise.push_back({sensor.name});
      }
    }
  }
  return noise;
}

std::string SensorWithoutObservations(const FitInput& input) {
  std::set<std::string> observed;
  for (const RecordingInput& recording : input.recordings) {
    const FitProblem& problem = recording.problem;
    for (const Observation& observation : problem.observations) {
      const int sensor =
          problem.channels.empty() ? -1 : problem.channels[observation.channel].sensor;
      if (sensor >= 0) observed.insert(problem.instruments.sensors[sensor].name);
    }
  }
  for (const RecordingInput& recording : input.recordings) {
    for (const Sensor& sensor : recording.problem.instruments.sensors) {
      if (sensor.estimate_sigma && observed.count(sensor.name) == 0) return sensor.name;
    }
  }
  return "";
}

void ScaleSigma(const std::vector<SensorNoise>& noise, const Instruments& instruments,
                const std::vector<Channel>& channels, std::vector<Observation>* observations) {
  for (Observation& observation : *observations) {
    const SensorNoise* const one =
        channels.empty() ? nullptr : NoiseOf(noise, instruments, channels[observation.channel]);
    if (one != nullptr) {
      observation.sigma *= one->factor;
    }
  }
}

bool UpdateNoise(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                 std::vector<SensorNoise>* noise, double* largest, std::string* message) {
  std::vector<SensorNoise> changes = *noise;
  const std::vector<std::vector<int>> rows = RowsOf(*problem, *noise);
  const Eigen::VectorXd& leverages = result.uncertainty.leverages;  // none: all are held
  for (size_t s = 0; s < noise->size(); ++s) {
    SensorNoise& one = (*noise)[s];
    one.count = static_cast<long>(rows[s].size());
    one.redundancy = static_cast<double>(one.count);
    for (const int row : rows[s]) {
      one.redundancy -= leverages.size() > 0 ? leverages[row] : 0.0;
    }
    const double sum = SquareSum(result.residuals, rows[s], options.huber);
    const double exact = kExactFit * kExactFit * static_cast<double>(one.count);
    if (!(one.redundancy > kLeastRedundancy) || !(sum > exact)) {
      *message = "the sigma of sensor \"" + one.name +
                 "\" cannot be estimated: its observations leave no residuals";
      return false;
    }
    changes[s].factor = std::sqrt(sum / one.redundancy);
    one.factor *= changes[s].factor;
    one.deviation = one.factor / std::sqrt(2.0 * one.redundancy);
    *largest = std::max(*largest, std::abs(changes[s].factor - 1.0) * one.factor / one.deviation);
  }
  for (int block = 0; block < problem->num_blocks(); ++block) {
    RolloutResiduals* const run = problem->run(block);
    run->ScaleSigma([&](std::vector<Observation>* observations) {
      ScaleSigma(changes, run->scene().instruments(), run->channels(), observations);
    });
  }
  return true;
}

}  // namespace tangible
