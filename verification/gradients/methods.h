// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The Jacobian of a scene's final state by every method, and the data that their comparison needs:
// the certificate (computed before any of them is compared), the discrete choices of the run, the
// sum of contributions to each entry, the error estimate of the differences.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tangible/simulation/gradient/gradient.h"
#include "tangible/verification/gradients/closed_form.h"
#include "tangible/verification/support/compare.h"
#include "tangible/verification/support/differences.h"

namespace tangible {

enum Method {
  kByTangent,
  kByAdjoint,
  kByAdjointRecomputed,  ///< factorisations computed again, not kept
  kByImplicitJets,
  kByUnrolledJets,
  kByCoarseDifference,  ///< central, of kPlainSteps[0] of the parameter's scale
  kByFineDifference,    ///< central, of kPlainSteps[1]
  kByRidders,           ///< extrapolated, with an error estimate
  kByClosedForm,
  kByPlus,        ///< the derivative for growing parameters, of those that are named
  kByMinus,       ///< for shrinking ones
  kByClosedPlus,  ///< both in closed form
  kByClosedMinus,
  kNumMethods
};

/// "tangent", "adjoint", ...
const char* NameOf(Method method);

/// An entry that a method did not compute.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct MethodJacobians {
  bool done = false;    ///< the run at the scene's own values
  std::string message;  ///< why not
  std::vector<std::string> outputs;
  /// For each parameter the certificate's verdict; empty where that is "trustworthy", of the
  /// discrete map too: all methods differentiate the same map.
  std::vector<std::string> named;
  Certificate certificate;  ///< with respect to all parameters
  RunTrace trace;
  Contributions contributions;                ///< support/compare.h
  MatrixX<double> jacobian[kNumMethods];      ///< outputs x parameters; empty where it was not run
  std::string missing[kNumMethods];           ///< why it was not run
  long unrolled_fallbacks = 0;                ///< steps solved by the implicit method instead
  std::vector<DifferenceColumn> differences;  ///< for each parameter
  double closed_form_tolerance = 0.0;
  VectorX<double> known_values;  ///< of the outputs in closed form; may be empty
  /// The least share r μ h / V that the friction of a joint can change in a step, r the mobility
  /// along it, of the largest speed V; 1 if there is none. With it the complementarity κ at which
  /// the interior point ends leaves a compliance of κ / share² of r where it sticks.
  double friction_share = 1.0;
};

/// Runs all of them. `known`: the closed form, if there is one; else that of FindClosedForm.
MethodJacobians RunMethods(const Scene& scene, const std::vector<ParameterPath>& parameters,
                           const std::optional<ClosedFormJacobian>& known = std::nullopt);

}  // namespace tangible
