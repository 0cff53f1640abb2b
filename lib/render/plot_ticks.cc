// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tangible/render/plot.h"
#include "tangible/render/tolerances.h"

namespace tangible {
namespace {

std::vector<double> LinearTicks(double low, double high, int count) {
  const double raw = (high - low) / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    // Rounding of the quotient must not turn 0.2 into 0.5.
    if (factor * power >= raw * (1.0 - kTickRounding)) {
      step = factor * power;
    }
  }
  std::vector<double> ticks;
  const double slack = kTickRounding * (high - low);
  // Counted from the first multiple, so that a step below the spacing of doubles at `low` still
  // ends.
  const double first = std::ceil((low - slack) / step);
  for (int i = 0; i <= 2 * count && (first + i) * step <= high + slack; ++i) {
    ticks.push_back((first + i) * step);
  }
  return ticks;
}

std::vector<double> LogarithmicTicks(double low, double high, int count) {
  const int first = static_cast<int>(std::floor(std::log10(low) + kTickRounding));
  const int last = static_cast<int>(std::ceil(std::log10(high) - kTickRounding));
  const int stride = std::max(1, (last - first + count - 1) / count);
  const auto inside = [&](double x) {
    return x >= low * (1.0 - kTickRounding) && x <= high * (1.0 + kTickRounding);
  };
  std::vector<double> powers;
  std::vector<double> finer;
  for (int exponent = first; exponent <= last; ++exponent) {
    const double power = std::pow(10.0, exponent);
    if (exponent % stride == 0 && inside(power)) {
      powers.push_back(power);
    }
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (inside(factor * power)) {
        finer.push_back(factor * power);
      }
    }
  }
  return powers.size() >= 3 ? powers : finer;
}

}  // namespace

std::vector<double> PlotTicks(double low, double high, AxisScale scale, int count) {
  if (!(low < high) || count < 1 || !std::isfinite(high - low)) {
    return {};
  }
  if (scale == AxisScale::kLinear) {
    return LinearTicks(low, high, count);
  }
  if (low <= 0.0) {
    return {};
  }
  std::vector<double> ticks = LogarithmicTicks(low, high, count);
  // Within less than a decade there may be none: then linear ticks are used.
  return ticks.size() >= 2 ? ticks : LinearTicks(low, high, count);
}

}  // namespace tangible
