// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/starts.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/fit/tolerances.h"
#include "tangible/render/html.h"

namespace tangible {

Eigen::VectorXd DrawStart(const std::vector<ParameterEntry>& entries, std::mt19937* random) {
  Eigen::VectorXd p(static_cast<Eigen::Index>(entries.size()));
  for (size_t k = 0; k < entries.size(); ++k) {
    const ParameterEntry& entry = entries[k];
    // mt19937 is the same everywhere; the library's distributions are not.
    const double part = ((*random)() + 0.5) / 4294967296.0;
    double low = entry.lower;
    double high = entry.upper;
    if (entry.logarithmic) {
      low = std::log(low > 0.0 ? low : std::min(0.1 * entry.initial, high));
      high = std::log(std::isfinite(high) ? high : std::max(10.0 * entry.initial, entry.lower));
    } else {
      low = std::isfinite(low) ? low : std::min(entry.initial - entry.scale, high);
      high = std::isfinite(high) ? high : std::max(entry.initial + entry.scale, low);
    }
    const double drawn = low + part * (high - low);
    p[static_cast<Eigen::Index>(k)] =
        std::clamp(entry.logarithmic ? std::exp(drawn) : drawn, entry.lower, entry.upper);
  }
  return p;
}

Eigen::VectorXd Shifted(const std::vector<ParameterEntry>& entries,
                        const std::vector<double>& estimate, double side) {
  const bool any = std::any_of(entries.begin(), entries.end(),
                               [](const ParameterEntry& entry) { return entry.of_contact; });
  Eigen::VectorXd p(static_cast<Eigen::Index>(entries.size()));
  for (size_t k = 0; k < entries.size(); ++k) {
    const ParameterEntry& entry = entries[k];
    const double shift = side * (!any ? kShiftOfAll : entry.of_contact ? kShift : 0.0);
    const double bound = side > 0.0 ? entry.upper : entry.lower;
    double value = estimate[k];
    if (entry.logarithmic) {
      value *= std::exp(shift);
    } else if (entry.of_contact && std::isfinite(bound)) {
      value += std::abs(shift) * (bound - value);
    } else {
      value += shift * std::max(std::abs(value), entry.scale);
    }
    p[static_cast<Eigen::Index>(k)] = std::clamp(value, entry.lower, entry.upper);
  }
  return p;
}

std::string DescribeAgreement(const std::vector<FitStart>& starts, double best) {
  if (starts.size() < 2) {
    return "";
  }
  std::string others;
  size_t agree = 0;
  for (const FitStart& start : starts) {
    if (start.cost <= best * (1.0 + kSameCost) + kAgree) {
      ++agree;
    } else {
      others += (others.empty() ? "" : ", ") +
                (std::isfinite(start.cost) ? CompactNumber(start.cost, 6) : "none");
    }
  }
  const size_t count = starts.size();
  std::string text = (agree == count ? "all " : std::to_string(agree) + " of ") +
                     std::to_string(count) + " starts " + (agree == 1 ? "ends" : "agree");
  if (agree == 1) {
    text = "1 of " + std::to_string(count) + " starts ends at the lowest cost";
  }
  return text + (others.empty()       ? ""
                 : agree + 1 == count ? "; the other ends at a cost of " + others
                                      : "; the others end at costs of " + others);
}

Eigen::VectorXd Nudged(const ParameterEntry& entry, int parameter, const Nudge& nudge,
                       Eigen::VectorXd p) {
  const double value = p[parameter];
  const double up = std::isfinite(entry.upper) ? entry.upper - value : HUGE_VAL;
  const double down = std::isfinite(entry.lower) ? value - entry.lower : HUGE_VAL;
  const bool upwards = (up >= down) == nudge.inwards;
  const double room = upwards ? up : down;
  // A bounded mass may be 10 000 times another one: it is moved by a part of itself.
  const double span = entry.logarithmic ? value : std::isfinite(room) ? room : entry.scale;
  const double move = std::min(nudge.fraction * span, room);
  p[parameter] += upwards ? move : -move;
  return p;
}

}  // namespace tangible
