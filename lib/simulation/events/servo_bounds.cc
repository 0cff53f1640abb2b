// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/servo_bounds.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/servo.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/event_search_inl.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The motion is examined at these shares of its length; where a servo goes beyond its bound from
// the start on, at powers of two of the first.
constexpr int kMostServoHalvings = 20;

}  // namespace

BoundReserve ReserveOf(const Model<double>& model, const State<double>& state, int servo,
                       double sign, double time, double middle) {
  BoundReserve reserve;
  const double limit = model.parameters[model.structure->servos[servo].Number(ServoIndex::kLimit)];
  reserve.value =
      limit - sign * UnboundedEffort(model, state, servo, {time, middle, 0.0}, &reserve.terms);
  reserve.terms += limit;
  return reserve;
}

double ReserveRate(const Model<double>& model, const State<double>& state, int servo, double sign,
                   double time, double middle, const std::vector<double>& accelerations) {
  const ModelStructure& s = *model.structure;
  const double step = kServoRateShare * s.settings.dt;
  State<double> moved = state;
  MovePoses(s, step, &moved);
  AddBodies(s, 0.5 * step * step, accelerations, &moved.pose);
  AddBodies(s, step, accelerations, &moved.twist);
  FollowPaths(model, time + step, middle, &moved);
  return (ReserveOf(model, moved, servo, sign, time + step, middle).value -
          ReserveOf(model, state, servo, sign, time, middle).value) /
         step;
}

void HoldServos(const Model<double>& model, SegmentFlow* flow, Segment* segment) {
  const ModelStructure& s = *model.structure;
  State<double>& before = segment->before;
  before.servo_modes.assign(s.servos.size(), 0);
  SolvedNode start;
  // First by the efforts. Of servos on their bounds either mode has the same accelerations, which
  // then tell where they go; without any no motion follows.
  for (const bool on_bounds : {false, true}) {
    for (int k = 0; k < static_cast<int>(s.servos.size()); ++k) {
      if (!s.servos[k].has_limit || !IsServoOn(model, k, segment->middle)) continue;
      for (const double sign : {1.0, -1.0}) {
        const BoundReserve left = ReserveOf(model, before, k, sign, segment->time, segment->middle);
        const bool is_on_bound = std::abs(left.value) <= kServoBound * left.terms;
        if (!on_bounds && left.value < 0.0) before.servo_modes[k] = sign > 0.0 ? 1 : -1;
        if (!on_bounds || !is_on_bound) continue;
        if (!flow->Accelerate(model, *segment, before, segment->time, &start)) return;
        const bool goes_beyond = ReserveRate(model, before, k, sign, segment->time, segment->middle,
                                             start.solution.motion) < 0.0;
        before.servo_modes[k] = !goes_beyond ? 0 : sign > 0.0 ? 1 : -1;
      }
    }
  }
}

ActiveContact ContactOfServo(const ModelStructure& structure, int servo) {
  const ServoIndex& index = structure.servos[servo];
  ActiveContact contact;
  contact.is_servo = true;
  contact.joint = index.joint;
  if (index.joint >= 0) {
    contact.a = structure.joints[index.joint].a;
    contact.b = structure.joints[index.joint].b;
  } else {
    contact.a = structure.forces[index.force].body;
    contact.b = structure.world();
  }
  return contact;
}

void EventSearch::SearchServos(const Model<double>& model, Event* event) {
  const std::vector<signed char>& modes = segment_->before.servo_modes;
  for (int k = 0; k < static_cast<int>(modes.size()); ++k) {
    if (!model.structure->servos[k].has_limit || !IsServoOn(model, k, segment_->middle)) continue;
    for (const double sign : {1.0, -1.0}) {
      if (modes[k] == 0 || modes[k] * sign > 0.0) SearchServo(model, k, sign, event);
    }
  }
}

// Searches for the first time at which a servo reaches its bound, or leaves it. The function is
// positive while the mode holds.
void EventSearch::SearchServo(const Model<double>& model, int servo, double sign, Event* event) {
  const double holds = segment_->before.servo_modes[servo] == 0 ? 1.0 : -1.0;
  const double middle = segment_->middle;
  const auto reserve_at = [&](const State<double>& state, double length) {
    return ReserveOf(model, state, servo, sign, segment_->time + length, middle);
  };
  const auto value_of = [&](const Sample& sample) {
    if (!sample.good) return std::numeric_limits<double>::quiet_NaN();
    return holds * reserve_at(sample.motion.after, sample.length).value;
  };
  const auto rate_at = [&](double length) {
    const Sample& sample = *At(model, length > 0.0 ? length : event->length);
    const Segment& motion = sample.motion;
    const auto& stage = length > 0.0 ? motion.stages[motion.num_stages - 1] : motion.stages[0];
    return holds * ReserveRate(model, length > 0.0 ? motion.after : segment_->before, servo, sign,
                               segment_->time + length, middle, stage.solution.motion);
  };
  Event trial;
  trial.kind = EventKind::kServoBound;
  trial.contact = ContactOfServo(*model.structure, servo);
  trial.index = servo;
  trial.sign = sign;
  const BoundReserve start = reserve_at(segment_->before, 0.0);
  const double tolerance = kServoLocated * start.terms;
  const double whole = event->length;
  double a = 0.0;
  double fa = holds * start.value;
  const auto ends_before = [&](double b, double fb) {
    if (!(fa > tolerance)) {
      // On its bound at the start: it comes back to it, or goes beyond it at once.
      double inside = b;
      for (int k = 0; k < kMostServoHalvings && !(fa > tolerance); ++k) {
        inside *= 0.5;
        fa = value_of(*At(model, inside));
        if (std::isnan(fa)) return;
        if (!(fa > tolerance)) {
          b = inside;
          fb = fa;
        }
      }
      a = inside;
      if (!(fa > tolerance)) {
        trial.length = b;
        trial.at_once = true;
        *event = trial;
        return;
      }
    }
    trial.length = Refine(model, value_of, tolerance, a, fa, b, fb);
    *event = trial;
  };
  for (const double share : {0.5, 1.0}) {
    const double b = share * whole;
    const double fb = value_of(*At(model, b));
    if (std::isnan(fb)) return;
    if (fb < -tolerance) return ends_before(b, fb);
    const double ra = rate_at(a), rb = rate_at(b);
    if (ra < 0.0 && rb > 0.0) {
      // The least value of the cubic through both ends lies between them.
      const HermiteCubic cubic(b - a, fa, ra, fb, rb);
      double low = 0.0, high = b - a;
      for (int k = 0; k < kMostServoHalvings; ++k) {
        const double m = 0.5 * (low + high);
        (cubic.RateAt(m) < 0.0 ? low : high) = m;
      }
      const double least = value_of(*At(model, a + high));
      if (least < -tolerance) return ends_before(a + high, least);
    }
    a = b;
    fa = fb;
  }
}

}  // namespace tangible
