// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/reference_extension.h"

#include <algorithm>
#include <string>

namespace tangible {

ExtendedReference::ExtendedReference(StepMap* map, long first_step, const Plan& plan)
    : map_(map), first_step_(first_step), plan_(plan) {
  so_far_.push_back(0);
  for (const std::vector<int>& of_step : plan.impacts) {
    impacts_.insert(impacts_.end(), of_step.begin(), of_step.end());
    so_far_.push_back(static_cast<long>(impacts_.size()));
  }
}

const ExtendedReference::Point& ExtendedReference::At(long k, const std::vector<int>& impacts) {
  const bool same = impacts.size() <= impacts_.size() &&
                    std::equal(impacts.begin(), impacts.end(), impacts_.begin());
  return InMode(k, same ? static_cast<long>(impacts.size()) : so_far_[k]);
}

const ExtendedReference::Point& ExtendedReference::InMode(long k, long count) {
  const auto [place, is_new] = points_.try_emplace({k, count});
  if (is_new) {
    place->second = count < so_far_[k]   ? Later(k, count)
                    : count > so_far_[k] ? Earlier(k, count)
                                         : Own(k);
  }
  return place->second;
}

ExtendedReference::Point ExtendedReference::Later(long k, long count) {
  // The previous state in the same mode: the plan's last one, or itself an extension.
  if (k == 0 || so_far_[k - 1] < count) return Own(k);
  StepMap* without = map_->Without(impacts_[count]);
  const Point before = InMode(k - 1, count);
  VectorX<double> next;
  std::string error;
  // If the plan is never in that mode, its own state is used.
  const bool of_mode = so_far_[k - 1] == count || before.gain < k - 1;
  if (without == nullptr || !of_mode ||
      !without->Step(first_step_ + k - 1, before.state, plan_.controls.row(k - 1), &next, &error)) {
    return Own(k);
  }
  return {next, before.gain};
}

ExtendedReference::Point ExtendedReference::Earlier(long k, long count) {
  const long steps = plan_.controls.rows();
  if (k == steps || so_far_[k + 1] > count) return Own(k);
  StepMap* without = map_->Without(impacts_[count - 1]);
  const Point after = InMode(k + 1, count);
  const bool of_mode = so_far_[k + 1] == count || after.gain != k + 1;
  VectorX<double> x;
  if (without == nullptr || !of_mode ||
      !without->StepBack(first_step_ + k, after.state, plan_.controls.row(k), &x)) {
    return Own(k);
  }
  return {x, after.gain == steps ? -1 : after.gain};
}

}  // namespace tangible
