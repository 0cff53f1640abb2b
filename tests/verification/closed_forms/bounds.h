// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What event stepping must hold where accelerations are constant between events.

#include <gtest/gtest.h>

#include <string>

#include "tangible/verification/closed_forms/comparison.h"

namespace tangible::closed_forms {

inline const Scheme kTrapezoidal = {"event, trapezoidal", Stepping::kEvent,
                                    Integrator::kTrapezoidal};
inline const Scheme kRungeKutta = {"event, runge_kutta_4", Stepping::kEvent,
                                   Integrator::kRungeKutta4};

/// Values and derivatives, adjoint and tangent, to 1e-9 |b| + 1e-13 scale.
inline void ExpectExact(const ClosedForm& form, int steps) {
  const Outcome exact = Exact(form);
  for (const Scheme& scheme : {kTrapezoidal, kRungeKutta}) {
    for (const Method method : {Method::kAdjoint, Method::kTangent}) {
      const Outcome got = Simulate(form, scheme, steps, method);
      ASSERT_EQ(got.message, "") << form.name << ", " << scheme.name;
      const Errors errors = Compare(form, got, exact);
      EXPECT_LE(errors.over_bound, 1.0)
          << form.name << ", " << scheme.name << ", "
          << (method == Method::kAdjoint ? "adjoint: " : "tangent: ") << errors.worst;
    }
  }
}

/// The same for all cases of a kind; a few of their derivatives must not be zero.
inline void ExpectAllExact(Kind kind) {
  int cases = 0;
  for (const ClosedForm& form : AllClosedForms()) {
    if (form.kind != kind) continue;
    ++cases;
    ExpectExact(form, form.instant > 0.0 ? 1 : 47);
  }
  EXPECT_GE(cases, 8);
}

inline double Derivative(const ClosedForm& form, const Outcome& outcome, const std::string& output,
                         const std::string& parameter) {
  for (size_t i = 0; i < form.outputs.size(); ++i) {
    for (size_t k = 0; k < form.parameters.size(); ++k) {
      if (form.outputs[i] == output && form.parameters[k].first == parameter) {
        return outcome.jacobian(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      }
    }
  }
  ADD_FAILURE() << output << ", " << parameter;
  return 0.0;
}

inline ClosedForm FormNamed(const std::string& name) {
  for (const ClosedForm& form : AllClosedForms()) {
    if (form.name == name) return form;
  }
  ADD_FAILURE() << name;
  return {};
}

}  // namespace tangible::closed_forms
