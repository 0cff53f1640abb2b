// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/certificate/certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace tangible {
namespace {

std::string Short(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1e", x);
  return text.data();
}

std::string At(const Certificate& certificate) {
  return certificate.margin_where.empty() ? "" : " at " + certificate.margin_where;
}

// The reason why the derivative may change nearby; empty if there is none.
std::string Kink(const Certificate& certificate) {
  if (!certificate.coordinates.empty()) {
    return certificate.coordinates;
  }
  if (certificate.degenerate_rows > 0) {
    return "kink of " + std::to_string(certificate.degenerate_rows) + " rows" + At(certificate);
  }
  if (certificate.margin_min < kNearKinkMargin) {
    return "margin " + Short(certificate.margin_min) + At(certificate);
  }
  if (!(certificate.linear_residual <= kLinearResidualLimit)) {
    return std::isfinite(certificate.linear_residual)
               ? "linear systems solved to " + Short(certificate.linear_residual) + " only"
               : "linear systems that were not solved";
  }
  if (!(certificate.condition <= kConditionLimit)) {
    return std::isfinite(certificate.condition)
               ? "condition " + Short(certificate.condition) + " of a linear system"
               : "a singular linear system";
  }
  return "";
}

}  // namespace

void Merge(const Certificate& other, Certificate& certificate) {
  if (other.margin_min < certificate.margin_min) {
    certificate.margin_min = other.margin_min;
    certificate.margin_where = other.margin_where;
  }
  certificate.degenerate_rows += other.degenerate_rows;
  certificate.redundant_rows += other.redundant_rows;
  certificate.condition = std::max(certificate.condition, other.condition);
  certificate.linear_residual = std::max(certificate.linear_residual, other.linear_residual);
  certificate.mode_switches += other.mode_switches;
  certificate.events += other.events;
  certificate.fallbacks += other.fallbacks;
  if (certificate.coordinates.empty()) certificate.coordinates = other.coordinates;
  if (certificate.one_sided.empty()) certificate.one_sided = other.one_sided;
  if (certificate.discontinuous.empty()) certificate.discontinuous = other.discontinuous;
  if (certificate.discrete_map.empty()) certificate.discrete_map = other.discrete_map;
  if (certificate.discrete_impact.empty()) certificate.discrete_impact = other.discrete_impact;
  for (const ValidityRadius& radius : other.radius) {
    const auto same = [&](const ValidityRadius& r) { return r.parameter == radius.parameter; };
    const auto own = std::find_if(certificate.radius.begin(), certificate.radius.end(), same);
    if (own == certificate.radius.end()) {
      certificate.radius.push_back(radius);
      continue;
    }
    if (radius.down < own->down) {
      own->down = radius.down;
      own->down_where = radius.down_where;
    }
    if (radius.up < own->up) {
      own->up = radius.up;
      own->up_where = radius.up_where;
    }
  }
  if (!(certificate.growth >= other.growth)) certificate.growth = other.growth;
  certificate.verdict.clear();
}

void SetVerdict(Certificate& certificate) {
  const std::string kink = Kink(certificate);
  certificate.verdict.clear();
  const auto add = [&certificate](const char* kind, const std::string& reason) {
    if (reason.empty()) return;
    certificate.verdict += (certificate.verdict.empty() ? "" : "; ") + (kind + reason);
  };
  add("discontinuous: ", certificate.discontinuous);
  add("near a kink: ", kink);
  add("one-sided: ", certificate.one_sided);
  if (certificate.verdict.empty()) certificate.verdict = kTrustworthy;
  if (!certificate.discrete_map.empty()) certificate.verdict.insert(0, kOfTheDiscreteMap);
}

std::string WithoutDiscreteMap(const std::string& verdict) {
  const std::string prefix = kOfTheDiscreteMap;
  return verdict.compare(0, prefix.size(), prefix) == 0 ? verdict.substr(prefix.size()) : verdict;
}

bool IsTrustworthyMap(const Certificate& certificate) {
  return WithoutDiscreteMap(certificate.verdict) == kTrustworthy;
}

std::string AdviceOf(const Certificate& certificate) {
  if (certificate.discrete_map.empty()) return "";
  return "the derivative is that of the discrete map and not of the motion, from " +
         certificate.discrete_map + "; " + kMotionInstead;
}

}  // namespace tangible
