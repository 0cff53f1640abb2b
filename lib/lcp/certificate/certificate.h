// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The certificate of a derivative: what a user needs to know to trust it.
//
// The map from data to solution is smooth while the contact modes stay the same and has kinks where
// they change; where values themselves jump it is discontinuous. The certificate reports how near
// kinks and jumps are, how well the linear systems of the derivative were solved, and what was done
// where the derivative is not unique.

#include <limits>
#include <string>
#include <vector>

#include "tangible/lcp/certificate/tolerances.h"

namespace tangible {

/// Above this condition number no digit of a linear system's solution is certain.
inline constexpr double kConditionLimit = 1e16;

/// How far a parameter may be changed, alone and to first order, until a discrete choice of the run
/// changes and with it the derivative: a slack over its rate. In the parameter's unit; infinite
/// where none changes within the parameter's range.
struct ValidityRadius {
  std::string parameter;
  double down = std::numeric_limits<double>::infinity();
  double up = std::numeric_limits<double>::infinity();
  std::string down_where{}, up_where{};  ///< the choice that changes first; empty if none does
};

struct Certificate {
  /// Smallest distance to a change of modes: zᵢ / ζᵢ for active, sᵢ / σᵢ for inactive rows.
  /// Infinite if there are no rows.
  double margin_min = std::numeric_limits<double>::infinity();
  std::string margin_where{};  ///< the row, contact or step of margin_min
  int degenerate_rows = 0;     ///< rows at a kink: z = s = 0, either mode possible
  int redundant_rows = 0;      ///< rank deficiency: z or y are not unique, v is
  double condition = 1.0;      ///< largest condition estimate of a linear system
  /// Largest relative residual of a linear solve. For a rollout in which the residual alone says
  /// little (very different masses, redundant rows, many events) it also includes the difference
  /// between its tangent and its adjoint.
  double linear_residual = 0.0;
  int mode_switches = 0;  ///< over a rollout: contacts that changed mode between steps
  int events = 0;         ///< over a rollout: impacts and other events
  int bounces_ended = 0;  ///< over a rollout: ever faster rebounds that were taken as over
  int fallbacks = 0;      ///< over a rollout: steps not solved by the first solver
  std::string
      coordinates{};        ///< where they round so coarsely that modes may be rounding; else empty
  std::string one_sided{};  ///< why the derivative is one-sided or a mean of two; else empty
  std::string discontinuous{};  ///< what makes the value itself jump nearby; else empty
  /// Where by fixed steps a restitution first acted, or a contact was first made or broken: from
  /// there on the derivative is that of the discrete map and not of the motion, because the time of
  /// the event, a multiple of dt, does not follow the parameters. Else empty.
  std::string discrete_map{};
  /// Of these, where dt does not matter, so that a smaller one does not help: the first impact with
  /// restitution, or a contact that is made in the last step. Else empty.
  std::string discrete_impact{};
  /// Of each parameter; empty where they were not asked for.
  std::vector<ValidityRadius> radius{};
  /// By which factor the run multiplies the largest of all small changes of its start, with
  /// lengths, and speeds over the duration, in units of the scene's size: 1.6 for a free flight,
  /// exp(λ T) with the largest Lyapunov exponent λ where it is chaotic. NaN where not asked for.
  double growth = std::numeric_limits<double>::quiet_NaN();
  std::string verdict{};  ///< written by SetVerdict
};

/// What the verdict of a derivative of the discrete map begins with.
inline constexpr char kOfTheDiscreteMap[] = "of the discrete map: ";
/// What gives the derivative of the motion instead, the end of a message.
inline constexpr char kMotionInstead[] =
    "\"stepping\": \"event\" in the scene's simulation differentiates the motion";
/// The verdict of a derivative that can be trusted.
inline constexpr char kTrustworthy[] = "trustworthy";

/// Adds `other` (another step of a rollout): the worse margin, condition and residual, the sum of
/// the counts, the first reasons, the smaller
/// radii. The verdict is cleared.
void Merge(const Certificate& other, Certificate& certificate);

/// Writes `verdict`: those that apply of "discontinuous: …", "near a kink: …" (coordinates that are
/// too large, degenerate rows, a margin below kNearKinkMargin, or a linear system that
/// was not solved or whose condition number exceeds kConditionLimit) and "one-sided: …", the worst
/// first, joined by "; "; if none applies, "trustworthy". All this follows kOfTheDiscreteMap where
/// the derivative is that of the discrete map.
void SetVerdict(Certificate& certificate);

/// The verdict without kOfTheDiscreteMap: that of the derivative as one of the map which the steps
/// compute. What asks whether methods agree, or whether there is a kink, asks this one.
std::string WithoutDiscreteMap(const std::string& verdict);
/// Whether it is kTrustworthy.
bool IsTrustworthyMap(const Certificate& certificate);

/// One line on what gives the derivative of the motion; empty where this is it.
std::string AdviceOf(const Certificate& certificate);

}  // namespace tangible
