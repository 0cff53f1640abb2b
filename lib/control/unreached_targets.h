// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Targets on which the controls have no effect from where a plan is: a ball that the hammer misses
// is as far from its mark whatever the hammer does. The gradient of such a cost is zero, and that
// is no optimum of what was asked for.

#include <vector>

#include "tangible/control/ilqr.h"

namespace tangible {

struct UnreachedTargets {
  /// Terms of the cost, ascending, that the plan does not meet and that no control changes to first
  /// order, in any step that counts for them.
  std::vector<int> terms;
  /// Whether these are all the terms that it does not meet; terms of controls are no targets.
  bool all = false;
  /// Terms without effect to first order that change with controls that are all 1 % smaller or
  /// larger: a cart that is pushed against its stop goes no further, but may stay back.
  std::vector<int> one_sided;
};

/// Of a plan whose states its controls cause. A target is met within kMetTarget of itself, or of 1
/// where that is larger. The effect is taken along motions whose controls all vary at once, at
/// random, and counts as none within kWithoutEffect of the largest effect on a number of the state.
/// Empty where a step has no derivative.
UnreachedTargets FindUnreachedTargets(const ControlProblem& problem, const Plan& plan);

}  // namespace tangible
