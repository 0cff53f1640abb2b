// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A column of a Jacobian by finite differences:
//
//   f'(p) ≈ (f(p + h) − f(p − h)) / 2h                    where both sides may be evaluated
//   f'(p) ≈ (−3 f(p) + 4 f(p ± h) − f(p ± 2h)) / ±2h      at the end of a range
//
// both of second order in h.

#include "tangible/math/scalar.h"

namespace tangible {

enum class Evaluated {
  kDone,
  kRefused,  ///< the parameter may not have this value
  kFailed,
};

struct DifferenceColumn {
  Evaluated status = Evaluated::kDone;
  double side = 0.0;  ///< 1 or −1 where it is one-sided
  VectorX<double> values;
};

/// `evaluate(shift, &values)` gives f(p + shift), `centre` is f(p).
template <typename Evaluate>
DifferenceColumn Difference(double h, const VectorX<double>& centre, const Evaluate& evaluate) {
  DifferenceColumn column;
  VectorX<double> above, below, further;
  const auto run = [&](double shift, VectorX<double>* values) {
    column.status = evaluate(shift, values);
    return column.status != Evaluated::kFailed;
  };
  if (!run(h, &above)) return column;
  const bool any_above = column.status == Evaluated::kDone;
  if (!run(-h, &below)) return column;
  const bool any_below = column.status == Evaluated::kDone;
  if (any_above && any_below) {
    column.values = (above - below) / (2.0 * h);
  } else if (any_above || any_below) {
    column.side = any_above ? 1.0 : -1.0;
    if (run(2.0 * column.side * h, &further) && column.status == Evaluated::kDone) {
      column.values =
          (-3.0 * centre + 4.0 * (any_above ? above : below) - further) / (2.0 * column.side * h);
    }
  }
  return column;
}

}  // namespace tangible
