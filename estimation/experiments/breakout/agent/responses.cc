// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/responses.h"

#include <cmath>

#include "tangible/estimation/experiments/breakout/agent/tolerances.h"

namespace tangible {
namespace {

constexpr size_t kMostReturns = 400;  // kept

// The kind of contact; each row of bricks is a kind of its own.
int ThingOf(Meeting meeting, int row) {
  return meeting == Meeting::kBrick ? 10 + row : static_cast<int>(meeting);
}

Vector2<double> Sizes(const Vector2<double>& v) { return v.cwiseAbs(); }

}  // namespace

Responses::Speed Responses::SpeedOf(const Vector2<double>& v) {
  return {static_cast<int>(std::lround(2.0 * std::abs(v.x()))),
          static_cast<int>(std::lround(2.0 * std::abs(v.y())))};
}

double Responses::Points(int row) const {
  const auto found = points_.find(row);
  return found == points_.end() ? 1.0 : found->second;
}

Vector2<double> Responses::After(Meeting meeting, int row, double offset,
                                 const Vector2<double>& before,
                                 const Vector2<double>& rigid) const {
  if (meeting == Meeting::kPaddle) return AfterPaddle(offset, before, rigid);
  // Signs are those of reflection at the wall, whatever face the engine's ball met.
  Vector2<double> speed = Sizes(before);
  const auto same = speeds_.find({ThingOf(meeting, row), SpeedOf(before)});
  if (same != speeds_.end()) {
    speed = same->second;
  } else if (meeting == Meeting::kBrick) {
    const auto of_row = of_row_.find(row);
    if (of_row != of_row_.end()) speed = of_row->second;
  }
  const double x = std::copysign(speed.x(), before.x()), y = std::copysign(speed.y(), before.y());
  return meeting == Meeting::kSide ? Vector2<double>(-x, y) : Vector2<double>(x, -y);
}

Vector2<double> Responses::AfterPaddle(double offset, const Vector2<double>& before,
                                       const Vector2<double>& rigid) const {
  // The nearest return at the same speed, with the same direction if there is one near enough.
  const Return *near = nullptr, *any = nullptr;
  double least = kSameOffset, least_of_any = HUGE_VAL;
  for (const Return& one : returns_) {
    const double distance = std::abs(one.offset - offset);
    const bool same_speed = SpeedOf(one.before) == SpeedOf(before);
    const bool same_way = one.before.x() * before.x() > 0.0;
    // At the same place, later returns are preferred.
    const double far = distance + (same_speed ? 0.0 : 0.5) + (same_way ? 0.0 : 0.25);
    if (far <= least) least = far, near = &one;
    if (same_speed && distance <= least_of_any) least_of_any = distance, any = &one;
  }
  if (near == nullptr) {
    // Without a return near this place, the ball is reflected like a rigid body, at the speed of
    // other returns.
    if (any == nullptr) return rigid;
    return {std::copysign(any->after.x(), before.x()), any->after.y()};
  }
  if (SpeedOf(near->before) == SpeedOf(before)) return near->after;
  // From a return at another speed only the direction is used.
  const Vector2<double> speed = any != nullptr ? Sizes(any->after) : Sizes(rigid);
  return {std::copysign(speed.x(), near->after.x()), -speed.y()};
}

void Responses::Learn(Meeting meeting, int row, double offset, const Vector2<double>& before,
                      const Vector2<double>& after) {
  if (meeting != Meeting::kPaddle) {
    speeds_[{ThingOf(meeting, row), SpeedOf(before)}] = Sizes(after);
    if (meeting == Meeting::kBrick) of_row_[row] = Sizes(after);
    return;
  }
  if (returns_.size() >= kMostReturns) {
    returns_.erase(returns_.begin(), returns_.begin() + kMostReturns / 4);
  }
  returns_.push_back({offset, before, after});
}

}  // namespace tangible
