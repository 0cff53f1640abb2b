// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The ways to differentiate a run; gradient.h compares them.

#include <string>
#include <utility>

namespace tangible {

enum class GradientMethod { kAuto, kAdjoint, kTangent, kJet, kJetImplicit, kFiniteDifference };

inline constexpr std::pair<const char*, GradientMethod> kGradientMethodNames[] = {
    {"auto", GradientMethod::kAuto},
    {"adjoint", GradientMethod::kAdjoint},
    {"tangent", GradientMethod::kTangent},
    {"jet", GradientMethod::kJet},
    {"jet_implicit", GradientMethod::kJetImplicit},
    {"finite_difference", GradientMethod::kFiniteDifference}};

/// "adjoint", ...
const char* NameOf(GradientMethod method);
/// False where no method has this name.
bool FindMethod(const std::string& name, GradientMethod* method);

/// Whether this build has the method: Jets need a width in TANGIBLE_JET_WIDTHS.
bool IsAvailable(GradientMethod method);

}  // namespace tangible
