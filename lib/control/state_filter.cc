// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/state_filter.h"

#include <utility>

#include "tangible/math/decompositions.h"

namespace tangible {

StateFilter::StateFilter(EngineStep* model, double dt, FilterOptions options)
    : model_(model), options_(std::move(options)), x_(model->initial()) {
  const Eigen::Index n = x_.size();
  const double initial = options_.initial_sigma, speed = options_.acceleration_sigma * dt;
  const MatrixX<double> onto_joints = model->JointProjector(0, x_);
  covariance_ = initial * initial * onto_joints * onto_joints.transpose();
  drift_.setZero(n);
  // Of a body: x, y, angle, and their speeds.
  for (Eigen::Index i = 0; i < n; ++i) drift_[i] = i % 6 < 3 ? 0.0 : speed * speed;
}

VectorX<double> StateFilter::Read(const VectorX<double>& x) const {
  VectorX<double> read(static_cast<Eigen::Index>(options_.sensors.size()));
  for (Eigen::Index i = 0; i < read.size(); ++i) {
    CostTerm sensor = options_.sensors[static_cast<size_t>(i)];
    sensor.target = 0.0;
    read[i] = ResidualOf(sensor, x, {});
  }
  return read;
}

void StateFilter::Correct(long k, const VectorX<double>& observed) {
  const Eigen::Index n = x_.size(), m = observed.size();
  const MatrixX<double> identity = MatrixX<double>::Identity(n, n);
  MatrixX<double> h(m, n);
  for (Eigen::Index i = 0; i < m; ++i) {
    h.row(i) = ChangesOf(options_.sensors[static_cast<size_t>(i)], x_, identity).transpose();
  }
  const MatrixX<double> spread = covariance_ * h.transpose();
  MatrixX<double> s = h * spread;
  s.diagonal() += options_.sigma.cwiseAbs2();
  const Cholesky factor(s);
  const VectorX<double> difference = observed - Read(x_);
  const VectorX<double> weighted = factor.Solve(difference);
  surprise_ = difference.dot(weighted);
  Move(k, spread * weighted);
  // Joseph's form, which stays positive semidefinite whatever rounding does.
  const MatrixX<double> gain = factor.Solve(MatrixX<double>(spread.transpose())).transpose();
  const MatrixX<double> kept = identity - gain * h;
  covariance_ = kept * covariance_ * kept.transpose() +
                gain * options_.sigma.cwiseAbs2().asDiagonal() * gain.transpose();
}

void StateFilter::Move(long k, const VectorX<double>& change) {
  // Poses go from one point on the joints to another. What a fixed step leaves of the joints'
  // errors stays, as it is the plant's too, and twists are brought along by the next step.
  const auto onto_joints = [&](VectorX<double> x) {
    double error = 0.0;
    model_->ProjectOntoJoints(k, &x, &error);
    return x;
  };
  const VectorX<double> moved = onto_joints(x_ + change) - onto_joints(x_);
  for (Eigen::Index i = 0; i < x_.size(); i += 6) {
    x_.segment<3>(i) += moved.segment<3>(i);
    x_.segment<3>(i + 3) += change.segment<3>(i + 3);
  }
}

bool StateFilter::Advance(long k, const VectorX<double>& u, std::string* error) {
  VectorX<double> next;
  MatrixX<double> a, b;
  if (!model_->Linearise(k, x_, u, &next, &a, &b, error)) return false;
  covariance_.diagonal() += drift_;
  covariance_ = a * covariance_ * a.transpose();
  x_ = next;
  return true;
}

}  // namespace tangible
