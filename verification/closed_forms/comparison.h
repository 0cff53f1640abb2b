// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The engine compared with closed forms: errors of values and of derivatives, and their order in
// dt.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/verification/closed_forms/closed_form.h"

namespace tangible::closed_forms {

struct Scheme {
  std::string name;
  Stepping stepping = Stepping::kFixed;
  Integrator integrator = Integrator::kSemiImplicitEuler;
};

/// fixed; event with trapezoidal, runge_kutta_4.
std::vector<Scheme> AllSchemes();

enum class Method { kAdjoint, kTangent };

struct Outcome {
  std::string message;       ///< empty, or why there is no result
  Eigen::VectorXd values;    ///< of the outputs
  Eigen::MatrixXd jacobian;  ///< outputs x parameters; NaN where there is none (T; no two sides)
};

/// The outcome of the formula.
Outcome Exact(const ClosedForm& form);

/// The outcome of the engine, in `steps` equal steps.
Outcome Simulate(const ClosedForm& form, const Scheme& scheme, int steps, Method method);

/// The entries that both have are compared. The scale is the largest |b| of its kind.
struct Errors {
  double value = 0.0;       ///< max |a − b| / scale
  double derivative = 0.0;  ///< max |a − b| / scale
  /// max |a − b| / (1e-9 |b| + 1e-13 scale), of values and derivatives: at most 1 is right to
  /// 1e-9, small numbers included.
  double over_bound = 0.0;
  std::string worst;  ///< where over_bound is: "y_T", "d y_T / d e"
};

Errors Compare(const ClosedForm& form, const Outcome& got, const Outcome& exact);

/// A case, a scheme: errors at each number of steps (adjoint).
struct Study {
  std::string form;
  Kind kind = Kind::kBallistic;
  std::string scheme;
  std::vector<int> steps;
  std::vector<double> dt;
  std::vector<Errors> errors;
  std::string message;       ///< empty, or what failed
  double value_order = 0.0;  ///< slope of log error over log dt; NaN where errors are rounding
  double derivative_order = 0.0;
};

/// Number of steps of a case without a duration: one.
Study RunStudy(const ClosedForm& form, const Scheme& scheme, const std::vector<int>& steps);

/// Least squares through (log dt, log error); NaN where fewer than three errors exceed `floor`.
double Order(const std::vector<double>& dt, const std::vector<double>& error, double floor);

}  // namespace tangible::closed_forms
