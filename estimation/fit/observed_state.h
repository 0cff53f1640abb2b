// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of a run at one time, from the observations around it.
//
// Through the samples of each observed coordinate that are nearest to the time t₀ a parabola is
// laid by weighted least squares,
//
//   value(t) ~ a + b (t − t₀) + ½ c (t − t₀)²
//
// through five of them at first and twice as many each time, as long as it explains them. The
// state (q, v) is the one that meets a and b best, and the joints and contacts:
//
//   minimise  Σ ((h(q, v) − a) / σ_a)² + Σ ((∂h/∂q v − b) / σ_b)²
//   with      C(q) = 0,  ∂C/∂q v = 0 of all joints,  gaps ≥ 0
//
// h is what would be observed, through whatever instruments and relative to whatever body; observed
// velocities have the first sum alone. σ_a and σ_b are the parabola's, larger where it explains the
// samples badly. Joints and contacts are rows of growing weight, at last 1e5 times that of the
// observations: a joint is then open by less than 1e-8 of a σ. The unknowns are poses and twists,
// or parameters that set them: joint angles and rates then too. What nothing determines stays as
// it was; an angle that is determined but for whole turns is within half a turn of where it was.

#include <Eigen/Core>
#include <vector>

#include "tangible/dynamics/model/state.h"
#include "tangible/estimation/problem/residual.h"

namespace tangible {

/// What a parabola through the samples of one observed coordinate says of it at one time.
struct SmoothedSeries {
  int observation = -1;  ///< one of the series
  double value = 0.0;    ///< a, in the observation's unit
  double value_sigma = 0.0;
  double rate = 0.0;        ///< b, per s
  double rate_sigma = 0.0;  ///< infinite: the samples say nothing of it
  int samples = 0;          ///< of the parabola
};

/// All series of a run at time t₀ (s, of the run).
std::vector<SmoothedSeries> SmoothAt(const RolloutResiduals& residuals, double time);

/// The state of the run at `time`, with the moving bodies' poses and twists sought from `guess`;
/// `guess` itself where there is none that is finite. The model is that of the scene as it is.
State<double> StateFromObservations(const RolloutResiduals& residuals, double time,
                                    const State<double>& guess);

/// The parameters with those that are `free` changed so that the initial state meets the
/// observations at time 0; within their bounds.
Eigen::VectorXd ParametersFromObservations(const RolloutResiduals& residuals,
                                           const std::vector<bool>& free);

/// Whether a parameter sets nothing but initial poses and twists of bodies, and angles and rates of
/// joints.
bool IsOfInitialState(const FitParameter& parameter);

}  // namespace tangible
