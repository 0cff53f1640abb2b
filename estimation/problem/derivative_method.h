// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The ways to differentiate a run; residual.h compares them.

namespace tangible {

enum class DerivativeMethod { kTangent, kAdjoint, kJet, kJetImplicit, kFiniteDifference };

/// "tangent", "adjoint", "jet", "jet_implicit", "finite_difference".
const char* NameOf(DerivativeMethod method);

/// Whether this build has the method: Jets need a width in TANGIBLE_JET_WIDTHS.
bool IsAvailable(DerivativeMethod method);

}  // namespace tangible
