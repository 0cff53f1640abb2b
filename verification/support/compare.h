// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How the Jacobians of a rollout by two methods (simulation/gradient.h) are compared.
//
// The outputs are the final poses and twists of the moving bodies, (x, y, angle, vx, vy, omega) a
// body. Two entries agree where
//
//   |a − b| ≤ tolerance |b| + 1e-13 S + 1e-14,
//
// with S the sum of the magnitudes of the contributions to the entry, o an output and p a
// parameter. After any number k of steps ∂o/∂p = Σᵢ w̄ₖ(i, o) ẇₖ(i, p) over all variables i, and the
// step after it passes on uᵀ (∂R/∂w) ẇ, with Kᵀ u = x̄ and K ẋ = −(∂R/∂w) ẇ (local_jacobian.h).
// Rounding in step k changes the entry by some ε of the magnitudes of the terms of these products,
// those of the linear solve included:
//
//   S(o, p) = Σₖ |w̄ₖ|ᵀ ⌈ẇₖ⌉ + |uₖ|ᵀ (|∂R/∂w| |ẇₖ₋₁| + |K| |ẋₖ|)
//   ⌈ẇₖ⌉ = |ẇₖ| but for  ⌈v̇⁺⌉ = M⁻¹ (the rows of (|∂R/∂w| |ẇ| + |K| |ẋ|) of momentum),
//                        ⌈q̇⁺⌉ = |q̇| + h ⌈v̇⁺⌉.
//
// S is large where large terms cancel (a body at rest, whose impulses cancel all that acts on it; a
// landing, which has ∂v/∂y of order 1/h). It is at least a tenth of the column's largest, as
// rounding inside of an element's derivatives, which is not seen here, is a fraction of those: an
// entry below 1e-15 of its column's contributions is rounding. 1e-13 is 450 ε: roundings of some
// steps.

#include <string>
#include <vector>

#include "tangible/scene/parameter.h"
#include "tangible/simulation/rollout.h"

namespace tangible {

/// S above, outputs x parameters.
MatrixX<double> ContributionMagnitudes(const Scene& scene,
                                       const std::vector<ParameterPath>& parameters);

/// |a − b| ≤ tolerance |b| + rounding S + 1e-14 for one entry.
bool Agree(double a, double b, double tolerance, double contributions, double rounding = 1e-13);

/// A closed contact of a step, with all discrete choices that its equations depend on.
struct ContactTrace {
  ActiveContact contact;
  ContactMode mode = ContactMode::kOpen;
  bool friction_tie = false, restitution_tie = false;  ///< at a kink of the mixing rule
};

/// A run with its discrete choices.
struct RunTrace {
  bool done = false;
  std::string message;
  VectorX<double> values;  ///< outputs
  std::vector<std::vector<ContactTrace>> steps;
  int closed = 0;      ///< closed contacts, over all steps
  int sliding = 0;     ///< of these, sliding
  int sticking = 0;    ///< of these, sticking
  int limits = 0;      ///< of these, joint limits
  int impacts = 0;     ///< of these, with restitution
  int recoveries = 0;  ///< of these, in penetration at the recovery speed
  int degenerate = 0;  ///< contacts within 1e-7 of a change of mode
  /// A closed contact's coefficient is at a kink of its mixing rule.
  bool friction_tie = false, restitution_tie = false;
};

RunTrace TraceRun(const Scene& scene);

/// Whether two runs made the same choices at closed contacts. `frictionless_may_slide`: contacts
/// without friction are the same as sliding ones (one-sided differences from friction 0).
enum class FrictionAtZero { kDistinct, kMaySlide };
bool SameChoices(const RunTrace& x, const RunTrace& y, FrictionAtZero friction);

/// How far the outputs' values are uncertain by rounding: the largest change of each in runs whose
/// initial state is changed by its last digits.
VectorX<double> RoundingNoise(const Scene& scene, const RunTrace& at);

enum class DifferenceStatus {
  kJudged,
  kChoicesDiffer,  ///< a kink or discontinuity lies within the smallest step
  kRunFailed,      ///< a perturbed scene could not be run
};

struct DifferenceColumn {
  DifferenceStatus status = DifferenceStatus::kRunFailed;
  VectorX<double> values;  ///< of the derivative, an output
  VectorX<double> errors;  ///< its estimated error
  double step = 0.0;       ///< the largest that was used
};

/// Differences with respect to one parameter, extrapolated over four steps from the largest (at
/// most 1e-3 of its scale) at which the runs on both sides make the choices of the run at its value
/// (Ridders: C. J. F. Ridders, Adv. Eng. Software 4 (1982) 75); one-sided at 0 of friction,
/// restitution, damping and the like, and at restitution 1. `noise` as RoundingNoise has it is part
/// of the estimated error.
DifferenceColumn FiniteDifferences(const Scene& scene, const RunTrace& at,
                                   const VectorX<double>& noise, const ParameterPath& parameter);

}  // namespace tangible
