// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/derivative_method.h"

#include "tangible/math/scalar.h"

namespace tangible {

const char* NameOf(DerivativeMethod method) {
  switch (method) {
    case DerivativeMethod::kTangent:
      return "tangent";
    case DerivativeMethod::kAdjoint:
      return "adjoint";
    case DerivativeMethod::kJet:
      return "jet";
    case DerivativeMethod::kJetImplicit:
      return "jet_implicit";
    case DerivativeMethod::kFiniteDifference:
      return "finite_difference";
  }
  return "";
}

bool IsAvailable(DerivativeMethod method) {
  int num_widths = 0;
#define TANGIBLE_COUNT_WIDTH(N) ++num_widths;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_COUNT_WIDTH)
#undef TANGIBLE_COUNT_WIDTH
  return (method != DerivativeMethod::kJet && method != DerivativeMethod::kJetImplicit) ||
         num_widths > 0;
}

}  // namespace tangible
