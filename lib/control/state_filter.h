// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of a plant from noisy observations of it, filtered by the model: an extended Kalman
// filter over the engine's exact step derivatives (Anderson and Moore, Optimal Filtering, 1979,
// chapter 8). With x⁺ = f(x, u), A = ∂f/∂x, and observations y = h(x) + σ ξ of which H = ∂h/∂x,
//
//   P⁺ = A (P + D) Aᵀ,   D: a random acceleration of each body
//
//   x̂ += P Hᵀ S⁻¹ (y − h(x̂)),   P −= P Hᵀ S⁻¹ H P,   S = H P Hᵀ + σ²
//
// The random acceleration, held over a step, stands for what the model does not have. It goes
// through the step as velocities do, so that the covariance stays along the joints, and corrections
// move poses along them (joint_state.h).

#include <string>
#include <vector>

#include "tangible/control/cost.h"
#include "tangible/control/engine_step.h"

namespace tangible {

struct FilterOptions {
  /// What each sensor reads, a number of the state or a coordinate of a point (its target and
  /// weight do not matter), and the standard deviations of its noise, in the unit read; > 0.
  std::vector<CostTerm> sensors;
  VectorX<double> sigma;
  /// Standard deviation of each number of the initial state, m, rad, m/s, rad/s.
  double initial_sigma = 0.1;
  /// Standard deviation of the random acceleration of each moving body, m/s² and rad/s².
  double acceleration_sigma = 1.0;
};

class StateFilter {
 public:
  /// Begins at the model's initial state. The model, whose steps are `dt` s, must outlive this.
  StateFilter(EngineStep* model, double dt, FilterOptions options);

  /// What the sensors read in a state, without noise.
  VectorX<double> Read(const VectorX<double>& x) const;

  /// Corrects the state at the start of step k by an observation.
  void Correct(long k, const VectorX<double>& observed);

  /// Makes step k; false where the model cannot: `error` says why, and the state stays.
  bool Advance(long k, const VectorX<double>& u, std::string* error);

  const VectorX<double>& state() const { return x_; }
  /// num_states x num_states, of the estimate.
  const MatrixX<double>& covariance() const { return covariance_; }
  /// (y − h)ᵀ S⁻¹ (y − h) of the last correction: about the number of sensors where the noise and
  /// the model are what they are said to be.
  double surprise() const { return surprise_; }

 private:
  void Move(long k, const VectorX<double>& change);

  EngineStep* model_;
  FilterOptions options_;
  VectorX<double> x_;
  MatrixX<double> covariance_;
  VectorX<double> drift_;  // of the random acceleration: the variances that a step adds
  double surprise_ = 0.0;
};

}  // namespace tangible
