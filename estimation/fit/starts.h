// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where the further starts of a fit begin, and one sentence about where they ended.

#include <Eigen/Core>
#include <random>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// A start drawn within the bounds, evenly in the minimiser's coordinates; where there is no bound,
/// within a factor of ten, or a typical magnitude, of the initial value.
Eigen::VectorXd DrawStart(const std::vector<ParameterEntry>& entries, std::mt19937* random);

/// Another start: an estimate with restitution and friction shifted up or down; where no parameter
/// is one of these, with all of them shifted by less.
Eigen::VectorXd Shifted(const std::vector<ParameterEntry>& entries,
                        const std::vector<double>& estimate, double side);

/// "2 of 3 starts agree; the other ends at a cost of 12.3"; empty of one start.
std::string DescribeAgreement(const std::vector<FitStart>& starts, double best);

/// A derivative may be 0 at a bound (restitution 0) or by symmetry. These moves into the interior,
/// as fractions of the distance to the other bound or of the scale, then show whether the parameter
/// has an effect. So do moves to the nearer bound: friction above that at which a contact sticks
/// has no effect, and less friction has one.
struct Nudge {
  bool inwards;
  double fraction;
};
inline constexpr Nudge kNudges[] = {{true, 0.1},  {true, 0.01}, {false, 0.5},
                                    {false, 0.9}, {false, 0.1}, {false, 0.01}};

/// `p` with this parameter moved.
Eigen::VectorXd Nudged(const ParameterEntry& entry, int parameter, const Nudge& nudge,
                       Eigen::VectorXd p);

}  // namespace tangible
