// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/derivative_method.h"

#include "tangible/simulation/gradient/jet_passes.h"

namespace tangible {

const char* NameOf(GradientMethod method) {
  return kGradientMethodNames[static_cast<int>(method)].first;
}

bool FindMethod(const std::string& name, GradientMethod* method) {
  for (const auto& [known, value] : kGradientMethodNames) {
    if (name == known) {
      *method = value;
      return true;
    }
  }
  return false;
}

bool IsAvailable(GradientMethod method) {
  return (method != GradientMethod::kJet && method != GradientMethod::kJetImplicit) ||
         JetWidthFor(1) > 0;
}

}  // namespace tangible
