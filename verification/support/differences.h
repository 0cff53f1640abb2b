// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Derivatives of a run's outputs by differences of runs that made the same choices (trace.h).

#include <string>

#include "tangible/scene/parameter.h"
#include "tangible/verification/support/trace.h"

namespace tangible {

/// The uncertainty of the outputs' values by rounding: the largest change of each in runs whose
/// masses and initial state are changed by their last digits.
VectorX<double> RoundingNoise(const Scene& scene, const RunTrace& at);

enum class DifferenceStatus {
  kJudged,
  kChoicesDiffer,  ///< a kink or discontinuity lies within the smallest step
  kRunFailed,      ///< a perturbed scene could not be run
};

/// Steps as fractions of the parameter's scale: truncation dominates the first, rounding the
/// second.
inline constexpr double kPlainSteps[2] = {1e-4, 6e-6};

/// A central quotient of one step (one-sided, of second order, at the end of a parameter's range).
struct PlainDifference {
  DifferenceStatus status = DifferenceStatus::kRunFailed;
  double step = 0.0;
  VectorX<double> values;  ///< of the outputs; also where choices differ; empty where a run failed
  std::string where;       ///< where choices differ, or what failed
};

struct DifferenceColumn {
  DifferenceStatus status = DifferenceStatus::kRunFailed;
  VectorX<double> values;  ///< of the derivative, an output
  VectorX<double> errors;  ///< its estimated error
  double step = 0.0;       ///< the largest that was used
  std::string where;       ///< unless judged: the first contact that differs, or what failed
  PlainDifference plain[2];
};

/// What to do where runs on both sides never make the same choices, or only so near the parameter
/// that the differences do not converge.
enum class ChoicesDiffer {
  kGiveUp,
  /// Take differences of each side separately (a body at rest that is thrown up falls down again,
  /// and its landing replaces the impulse of its weight meanwhile): the result counts where both
  /// sides agree to 1e-5 of the largest. Poses are uncertain by the touching tolerance, because a
  /// body that leaves by less is found to land that much lower; where sides differ, twists are
  /// uncertain by the effect of that on the motion.
  kCompareSides,
};

/// Differences with respect to one parameter, extrapolated over four steps from the largest (at
/// most 1e-3 of its scale, down to 1e-11 of it) at which the runs on both sides make the choices of
/// the run at its value (Ridders: C. J. F. Ridders, Adv. Eng. Software 4 (1982) 75); one-sided at 0
/// of friction, restitution, damping and the like, and at restitution 1. The estimated error
/// includes `noise`, the result of RoundingNoise.
DifferenceColumn FiniteDifferences(const Scene& scene, const RunTrace& at,
                                   const VectorX<double>& noise, const ParameterPath& parameter,
                                   ChoicesDiffer choices_differ = ChoicesDiffer::kGiveUp);

}  // namespace tangible
