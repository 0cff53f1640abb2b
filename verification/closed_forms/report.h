// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Studies as a table, as JSON and as a picture, and the bounds that they must satisfy.

#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/verification/closed_forms/comparison.h"

namespace tangible::closed_forms {

/// All cases by all schemes, in 50, 100, 200, 400 and 800 steps.
std::vector<Study> RunAllStudies();

/// The broken bounds, one line each: event stepping with trapezoidal or runge_kutta_4 is exact to
/// 1e-9 where accelerations are constant between events, else of order 1.9 and 3.8 at least.
std::vector<std::string> BrokenBounds(const std::vector<Study>& studies);

/// A line for each case: errors with the smallest dt and the orders, fixed and event stepping side
/// by side.
std::string TableText(const std::vector<Study>& studies);

OrderedJson ToJson(const std::vector<Study>& studies);

/// Errors of the derivatives over dt: a bounce and a double pendulum by each scheme.
std::string Picture(const std::vector<Study>& studies);

}  // namespace tangible::closed_forms
