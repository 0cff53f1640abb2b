// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of a run at one time, from the observations around it.
//
// A parabola is fitted by weighted least squares to the samples of each observed coordinate that
// are nearest to the time t₀,
//
//   value(t) ~ a + b (t − t₀) + ½ c (t − t₀)²
//
// to five of them at first and to twice as many each time, as long as it explains them. The state
// (q, v) is the one that agrees best with a and b while it satisfies joints and contacts:
//
//   minimise  Σ ((h(q, v) − a) / σ_a)² + Σ ((∂h/∂q v − b) / σ_b)²
//   with      C(q) = 0,  ∂C/∂q v = 0 of all joints,  gaps ≥ 0
//
// h is the predicted observation, with its instruments and relative to its reference body; observed
// velocities enter the first sum only. σ_a and σ_b are the standard deviations of the parabola,
// larger where it explains the samples badly. Joints and contacts are rows of increasing weight, at
// the end 1e5 times that of the observations, so that a joint is open by less than 1e-8 of a σ. The
// unknowns are poses and twists, or the parameters that set them, which may also be joint angles
// and rates. Unknowns that nothing determines keep their values; an angle
// that is determined but for whole turns is within half a turn of its value.

#include <Eigen/Core>
#include <vector>

#include "tangible/dynamics/model/state.h"
#include "tangible/estimation/problem/residual.h"

namespace tangible {

/// The value and the rate of one observed coordinate at one time, by a parabola through its
/// samples.
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

/// The state of the run at `time`, where the poses and twists of moving bodies are estimated from
/// `guess`; `guess` itself where no estimate is finite. The model is that of the scene at its
/// current parameters.
State<double> StateFromObservations(const RolloutResiduals& residuals, double time,
                                    const State<double>& guess);

/// The parameters with those that are `free` changed so that the initial state meets the
/// observations at time 0; within their bounds.
Eigen::VectorXd ParametersFromObservations(const RolloutResiduals& residuals,
                                           const std::vector<bool>& free);

/// Whether a parameter sets nothing but initial poses and twists of bodies, and angles,
/// displacements and rates of joints. The position of a body that a hinge, slider, weld or rod
/// holds is a length: it moves the anchor on the body.
bool IsOfInitialState(const Scene& scene, const FitParameter& parameter);

}  // namespace tangible
