// SPDX-License-Identifier: Apache-2.0
#pragma once
// Coupling of two joints' coordinates: x_1 + ratio x_2 stays as it is at time 0, or is the
// coordinate that limits bound. Each coordinate is that of its own joint, which is evaluated apart:
// derivatives take the shares one by one, because together they would read more variables than a
// local Jet has. Numbers: the ratio, and the value at time 0.

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// Turns the rows of the coupled joint k, whose coordinate has been evaluated, into its share of
/// the coupling's rows: a row, or a coordinate, on the bodies of that joint.
template <typename T>
void ScaleToShare(JointType type, int k, const T numbers[2], JointRows<T>* share) {
  const T factor = k == 0 ? T(1.0) : numbers[0];
  for (int i = 0; i < 3; ++i) {
    share->coordinate_a[i] = factor * share->coordinate_a[i];
    share->coordinate_b[i] = factor * share->coordinate_b[i];
  }
  share->coordinate = factor * share->coordinate;
  if (k == 0) share->coordinate -= numbers[1];
  share->rows = 0;
  if (type == JointType::kCoupling) {
    share->rows = 1;
    share->row_a[0] = share->coordinate_a;
    share->row_b[0] = share->coordinate_b;
    share->error[0] = share->coordinate;
  }
}

/// Adds a share to the rows of the coupling, on its own bodies; `of` is the coupled joint. What it
/// has on static bodies has no effect.
template <typename T>
void AddShare(const JointIndex& coupling, const JointIndex& of, int k, const JointRows<T>& share,
              JointRows<T>* out) {
  if (k == 0) {
    for (RowPart<T>* row : {&out->coordinate_a, &out->coordinate_b, &out->row_c, &out->row_d}) {
      *row = {T(0.0), T(0.0), T(0.0)};
    }
    out->coordinate = T(0.0);
  }
  const auto add = [&](int body, const RowPart<T>& part) {
    RowPart<T>* const row = body == coupling.a   ? &out->coordinate_a
                            : body == coupling.b ? &out->coordinate_b
                            : body == coupling.c ? &out->row_c
                            : body == coupling.d ? &out->row_d
                                                 : nullptr;
    for (int i = 0; i < 3 && row != nullptr; ++i) (*row)[i] += part[i];
  };
  add(of.a, share.coordinate_a);
  add(of.b, share.coordinate_b);
  out->coordinate += share.coordinate;
  out->rows = share.rows;
  if (share.rows > 0) {
    out->row_a[0] = out->coordinate_a;
    out->row_b[0] = out->coordinate_b;
    out->error[0] = out->coordinate;
  }
}

}  // namespace tangible
