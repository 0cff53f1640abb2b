// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tangible {
namespace {

constexpr int kMostFits = 20;
// Of the factor's own deviation.
constexpr double kFactorSettled = 1e-3;
constexpr double kDeviationByMedian = 1.4826;

/// Σ r² of the rows of a sensor, or what stands for it with Huber's loss.
double SquareSum(const Eigen::VectorXd& residuals, const std::vector<int>& rows, double huber) {
  if (huber > 0.0) {
    std::vector<double> sizes;
    sizes.reserve(rows.size());
    for (const int i : rows) {
      sizes.push_back(std::abs(residuals[i]));
    }
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    const double deviation = kDeviationByMedian * *middle;
    return static_cast<double>(rows.size()) * deviation * deviation;
  }
  double sum = 0.0;
  for (const int i : rows) {
    sum += residuals[i] * residuals[i];
  }
  return sum;
}

/// tr(C J_sᵀ J_s); parameters without a covariance are held.
double TakenBy(const RowMatrixXd& covariance, const RowMatrixXd& jacobian,
               const std::vector<int>& rows) {
  std::vector<int> free;
  for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
    if (std::isfinite(covariance(k, k))) {
      free.push_back(static_cast<int>(k));
    }
  }
  const RowMatrixXd part = jacobian(rows, free);
  const RowMatrixXd c = covariance(free, free);
  return (part * c).cwiseProduct(part).sum();
}

/// The rows of each sensor whose sigma is estimated.
std::vector<std::vector<int>> RowsOf(const RolloutResiduals& residuals,
                                     const std::vector<SensorNoise>& noise) {
  std::vector<std::vector<int>> rows(noise.size());
  for (int i = 0; i < residuals.num_residuals(); ++i) {
    const int sensor = residuals.ChannelOf(residuals.observations()[i]).sensor;
    for (size_t s = 0; s < noise.size(); ++s) {
      if (noise[s].sensor == sensor) {
        rows[s].push_back(i);
      }
    }
  }
  return rows;
}

/// Equation (1); false, with a message, where it cannot be taken. `largest` gets the largest change
/// in the factors' deviations.
bool Update(const FitOptions& options, const std::vector<std::vector<int>>& rows,
            RolloutResiduals* residuals, FitResult* result, std::vector<SensorNoise>* noise,
            double* largest) {
  Eigen::VectorXd values;
  RowMatrixXd jacobian;
  if (!residuals->Evaluate(result->estimate, options.derivatives, &values, &jacobian)) {
    result->message = "the run at the estimate fails: " + residuals->message();
    return false;
  }
  std::vector<SensorNoise> changes = *noise;
  *largest = 0.0;
  for (size_t s = 0; s < noise->size(); ++s) {
    SensorNoise& one = (*noise)[s];
    one.count = static_cast<long>(rows[s].size());
    one.redundancy =
        static_cast<double>(one.count) - TakenBy(result->uncertainty.covariance, jacobian, rows[s]);
    const double sum = SquareSum(values, rows[s], options.huber);
    if (!(one.redundancy > 0.5) || !(sum > 0.0)) {
      result->message = "the sigma of sensor \"" + one.name +
                        "\" cannot be estimated: its observations leave no residuals";
      return false;
    }
    changes[s].factor = std::sqrt(sum / one.redundancy);
    one.factor *= changes[s].factor;
    one.deviation = one.factor / std::sqrt(2.0 * one.redundancy);
    *largest = std::max(*largest, std::abs(changes[s].factor - 1.0) * one.factor / one.deviation);
  }
  residuals->ScaleSigma([&](std::vector<Observation>* observations) {
    ScaleSigma(changes, residuals->channels(), observations);
  });
  return true;
}

/// `next` as the continuation of `result`.
void Append(FitResult next, FitResult* result) {
  std::vector<FitIteration> iterations = std::move(result->iterations);
  for (FitIteration& iteration : next.iterations) {
    iteration.seconds += result->seconds;
    iterations.push_back(std::move(iteration));
  }
  next.iterations = std::move(iterations);
  next.starts = std::move(result->starts);
  next.initial_cost = result->initial_cost;
  next.rollouts += result->rollouts;
  next.seconds += result->seconds;
  *result = std::move(next);
}

}  // namespace

bool EstimatesNoise(const Instruments& instruments) {
  return std::any_of(instruments.sensors.begin(), instruments.sensors.end(),
                     [](const Sensor& sensor) { return sensor.estimate_sigma; });
}

void ScaleSigma(const std::vector<SensorNoise>& noise, const std::vector<Channel>& channels,
                std::vector<Observation>* observations) {
  for (Observation& observation : *observations) {
    for (const SensorNoise& one : noise) {
      if (channels[observation.channel].sensor == one.sensor) {
        observation.sigma *= one.factor;
      }
    }
  }
}

FitResult FitWithSensorNoise(const FitOptions& options, RolloutResiduals* residuals,
                             const FitProgress& progress, std::vector<SensorNoise>* noise) {
  noise->clear();
  const std::vector<Sensor>& sensors = residuals->scene().instruments().sensors;
  for (size_t s = 0; s < sensors.size(); ++s) {
    if (sensors[s].estimate_sigma) {
      noise->push_back({static_cast<int>(s), sensors[s].name});
    }
  }
  const std::vector<std::vector<int>> rows = RowsOf(*residuals, *noise);
  // What judges the estimate is done once, for the factors that are found.
  FitOptions search = options;
  search.certificate = CertificatePass::kSkip;
  search.held_test = HeldTest::kSkip;
  FitResult result = Fit(search, residuals, progress);
  search.starts = 1;
  search.approach = FitApproach::kPlain;
  double largest = 0.0;
  for (int fits = 1; result.status == FitStatus::kConverged; ++fits) {
    if (!Update(options, rows, residuals, &result, noise, &largest)) {
      result.status = FitStatus::kNotConverged;
      break;
    }
    residuals->SetInitial(result.estimate);
    const bool settled = largest < kFactorSettled;
    if (settled) {
      search.certificate = options.certificate;
      search.held_test = options.held_test;
    }
    Append(Fit(search, residuals, {}), &result);
    if (settled) {
      break;
    }
    if (fits == kMostFits) {
      result.status = FitStatus::kNotConverged;
      result.message =
          "the sigma of the sensors did not settle in " + std::to_string(fits) + " fits";
      break;
    }
  }
  return result;
}

}  // namespace tangible
