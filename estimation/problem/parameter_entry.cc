// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/parameter_entry.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>

#include "tangible/estimation/problem/tolerances.h"

namespace tangible {
namespace {

/// Applies `function` to each entry and its number in `x`.
template <typename Function>
Eigen::VectorXd Map(const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& x,
                    const Function& function) {
  CHECK_EQ(x.size(), static_cast<Eigen::Index>(entries.size()));
  Eigen::VectorXd y(x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    y[k] = function(entries[static_cast<size_t>(k)], x[k]);
  }
  return y;
}

}  // namespace

double ToInternal(const ParameterEntry& entry, double p) {
  return entry.logarithmic ? std::log(p / entry.initial) : p / entry.scale;
}

double ToParameter(const ParameterEntry& entry, double q) {
  const double p = entry.logarithmic ? entry.initial * std::exp(q) : q * entry.scale;
  // exp(ln(upper / p_0)) p_0 may pass the bound by a rounding.
  return std::clamp(p, LeastOf(entry), entry.upper);
}

double LeastOf(const ParameterEntry& entry) {
  const bool open = entry.logarithmic && entry.lower == 0.0;
  return open ? kVanished * entry.initial : entry.lower;
}

double ParameterByInternal(const ParameterEntry& entry, double p) {
  return entry.logarithmic ? p : entry.scale;
}

bool IsAtBound(const ParameterEntry& entry, double p) {
  const double slack = kBoundRounding * std::max(std::abs(p), entry.scale);
  const double least = LeastOf(entry);
  return p <= least + (least > entry.lower ? kBoundRounding * least : slack) ||
         p >= entry.upper - slack;
}

Eigen::VectorXd InitialOf(const std::vector<ParameterEntry>& entries) {
  return Map(entries, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(entries.size())),
             [](const ParameterEntry& entry, double) { return entry.initial; });
}

Eigen::VectorXd ToInternal(const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& p) {
  return Map(entries, p,
             [](const ParameterEntry& entry, double x) { return ToInternal(entry, x); });
}

Eigen::VectorXd ToParameters(const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& q) {
  return Map(entries, q, ToParameter);
}

Eigen::VectorXd ParametersByInternal(const std::vector<ParameterEntry>& entries,
                                     const Eigen::VectorXd& p) {
  return Map(entries, p, ParameterByInternal);
}

}  // namespace tangible
