// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Initial value problems y' = f(y) to about rounding: Gragg's method, extrapolated to order 16
// (Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, II.9).

#include <cstddef>
#include <functional>
#include <vector>

namespace tangible {

/// y(large) by an even number of steps of the midpoint rule, the first one Euler's.
template <typename T>
std::vector<T> Midpoints(const std::function<std::vector<T>(const std::vector<T>&)>& f,
                         const std::vector<T>& y, const T& large, int parts) {
  const T h = large / static_cast<double>(parts);
  std::vector<T> before = y, now = y;
  const std::vector<T> start = f(y);
  for (size_t i = 0; i < y.size(); ++i) now[i] += h * start[i];
  for (int part = 1; part < parts; ++part) {
    const std::vector<T> rate = f(now);
    for (size_t i = 0; i < y.size(); ++i) {
      const T next = before[i] + 2.0 * h * rate[i];
      before[i] = now[i];
      now[i] = next;
    }
  }
  return now;
}

/// y(time) in `steps` large steps. The error falls as (time / steps)^16; T may carry derivatives,
/// `time` among them.
template <typename T>
std::vector<T> Extrapolate(const std::function<std::vector<T>(const std::vector<T>&)>& f,
                           std::vector<T> y, const T& time, int steps) {
  constexpr int kColumns = 8;
  const T large = time / static_cast<double>(steps);
  for (int step = 0; step < steps; ++step) {
    std::vector<std::vector<T>> last, row;  // of Neville's triangle in (1 / parts)²
    for (int j = 0; j < kColumns; ++j) {
      row = {Midpoints(f, y, large, 2 * (j + 1))};
      for (int k = 1; k <= j; ++k) {
        const double ratio = static_cast<double>(j + 1) / (j + 1 - k);
        row.push_back(row[k - 1]);
        for (size_t i = 0; i < y.size(); ++i) {
          row[k][i] += (row[k - 1][i] - last[k - 1][i]) / (ratio * ratio - 1.0);
        }
      }
      last = row;
    }
    y = row.back();
  }
  return y;
}

}  // namespace tangible
