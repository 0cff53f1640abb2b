// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The minimiser's data of a parameter, and the variable in which it steps.
//
//   q = ln(p / initial)   for a parameter that is positive by its bounds
//   q = p / scale         for any other, with a typical magnitude
//
// unless the user chose one of them. A mass that starts ten times too small is then as far from its
// value as one that starts ten times too large, and steps of different parameters are comparable.
// The optimum and the covariance, which is stated for p, do not depend on this choice.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/problem/prior.h"

namespace tangible {

struct ParameterEntry {
  std::string name;
  double initial = 0.0;
  double lower = 0.0;  ///< −inf: not bounded
  double upper = 0.0;
  bool logarithmic = false;  ///< the variable is ln(p / initial)
  double scale = 1.0;        ///< typical magnitude, > 0
  std::optional<Prior> prior = std::nullopt;
  bool of_contact = false;  ///< it sets a restitution or a friction
};

/// q of p.
double ToInternal(const ParameterEntry& entry, double p);
/// p of q, kept within the bounds.
double ToParameter(const ParameterEntry& entry, double q);
/// dp/dq at p.
double ParameterByInternal(const ParameterEntry& entry, double p);

/// The least value that p takes: its lower bound; where that is 0 and the variable a logarithm,
/// which never reaches it, kVanished of the initial value.
double LeastOf(const ParameterEntry& entry);

/// Whether p lies on a bound, up to rounding, or is the least value that it takes.
bool IsAtBound(const ParameterEntry& entry, double p);

/// The same for vectors of parameters, one for each entry.
Eigen::VectorXd InitialOf(const std::vector<ParameterEntry>& entries);
Eigen::VectorXd ToInternal(const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& p);
Eigen::VectorXd ToParameters(const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& q);
Eigen::VectorXd ParametersByInternal(const std::vector<ParameterEntry>& entries,
                                     const Eigen::VectorXd& p);

}  // namespace tangible
