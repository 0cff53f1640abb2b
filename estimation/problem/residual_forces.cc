// SPDX-License-Identifier: Apache-2.0
//
// The parts of the residuals of a run that concern forces of joints and contacts (force_rows.h):
//
//   r = (gain f + bias − observed) / σ      by the sensor
#include "tangible/estimation/problem/residual.h"

namespace tangible {

void RolloutResiduals::AddForces(long k, Stepper* stepper) {
  if (stepper == nullptr) return;
  forces_.Add(k, scene_.model(), stepper);
  for (const int row : forces_.ReadAt(k)) {
    samples_[static_cast<size_t>(ForceRow(row))] = forces_.Value(row);
  }
}

double RolloutResiduals::GainOf(int i) const {
  const int sensor = ChannelOf(observations_[i]).sensor;
  return sensor < 0 ? 1.0 : scene_.instruments().sensors[sensor].gain;
}

double RolloutResiduals::RecordedForce(int i, double force) const {
  const int sensor = ChannelOf(observations_[i]).sensor;
  return sensor < 0 ? force : GainOf(i) * force + scene_.instruments().sensors[sensor].bias;
}

/// What a row of J owes to the sensor's parameters.
Eigen::RowVectorXd RolloutResiduals::ForceDirectTerm(int i, double force) const {
  const int sensor = ChannelOf(observations_[i]).sensor;
  Eigen::RowVectorXd term = Eigen::RowVectorXd::Zero(num_parameters());
  if (sensor < 0) return term;
  const RowMatrixXd& by_number = scene_.instrument_derivatives();
  const int first = scene_.instruments().SensorNumber(sensor);
  term += force * by_number.row(first + 1) + by_number.row(first + 2);
  return term / observations_[i].sigma;
}

}  // namespace tangible
