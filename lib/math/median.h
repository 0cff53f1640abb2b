// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tangible {

/// The value in the middle, of an even number the larger of the two; NaN of none.
inline double UpperMedian(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value in the middle, of an even number the mean of the two; NaN of none.
inline double Median(std::vector<double> values) {
  const double upper = UpperMedian(values);
  if (values.empty() || values.size() % 2 == 1) return upper;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2 - 1);
  std::nth_element(values.begin(), middle, values.end());
  return 0.5 * (*middle + upper);
}

}  // namespace tangible
