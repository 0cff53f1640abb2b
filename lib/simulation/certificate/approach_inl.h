// SPDX-License-Identifier: Apache-2.0
#pragma once
// The speed with which a contact of a fixed step closes. Included by files of this folder alone.

#include <cmath>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

// The speed n·v before the step, and after a free motion without contacts and joints, m/s.
struct Approach {
  double before = 0.0;
  double free = 0.0;
  double terms = 0.0;  // the sum of the magnitudes of the terms of `before`
};

inline Approach ApproachOf(const ModelStructure& s, const StepRecord& r, size_t i) {
  const ActiveContact& contact = r.contacts[i];
  const ContactBlock<double>& block = r.problem.contacts[i];
  Approach approach;
  const auto add = [&](int body, const RowPart<double>& row) {
    const int moving = s.bodies[body].block;
    for (int k = 0; k < 3; ++k) {
      const double twist = r.before.twist[3 * body + k];
      approach.before += row[k] * twist;
      approach.terms += std::abs(row[k] * twist);
      approach.free +=
          row[k] *
          (moving < 0 ? twist : r.problem.load[3 * moving + k] / r.problem.mass[3 * moving + k]);
    }
  };
  add(contact.a, block.normal_a);
  add(contact.b, block.normal_b);
  return approach;
}

}  // namespace tangible
