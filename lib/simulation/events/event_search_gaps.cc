// SPDX-License-Identifier: Apache-2.0
//
// The search for gaps that close, except for those of pairs of bodies: returns of contacts in
// penetration, and joints that reach their limits.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/math/scalar.h"
#include "tangible/simulation/events/event_search_inl.h"

namespace tangible {
namespace {

// The gap of a contact or limit, and the speed at which it grows.
double GapAndSpeed(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact, double* speed) {
  ContactRows<double> rows;
  EvaluateActiveRows(model, state, contact, &rows);
  *speed = RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b);
  return rows.geometry.gap;
}

// The error of poses while the bodies of a limit turn by an angle, which is of second order in the
// angle, plus the change by corrections.
double CutByPoses(const Model<double>& model, const Segment& motion, double length,
                  const ActiveContact& limit) {
  const State<double>& at = motion.after;
  const auto apart = [&](const std::vector<double>& of) {
    return std::hypot(of[3 * limit.a] - of[3 * limit.b], of[3 * limit.a + 1] - of[3 * limit.b + 1]);
  };
  const double turn =
      length * std::max(std::abs(at.twist[3 * limit.a + 2]), std::abs(at.twist[3 * limit.b + 2]));
  double moved = turn * (turn * apart(at.pose) + length * apart(at.twist));
  for (int k = 0; k < motion.num_corrections; ++k) {
    for (const int body : {limit.a, limit.b}) {
      if (const int block = model.structure->bodies[body].block; block >= 0) {
        const double* by = &motion.corrections[k].solution.motion[3 * block];
        moved += std::hypot(by[0], by[1]) + std::abs(by[2]) * std::max(1.0, apart(at.pose));
      }
    }
  }
  return moved;
}

}  // namespace

// Between two states of a pair `length` apart in time: whether neither turns by more than a third
// of a radian nor moves by more than the smaller one's size. The height of an ellipse changes its
// course within an angle of b / a, which takes the place of a radian.
bool EventSearch::MovesLittle(const Model<double>& model, const State<double>& before,
                              const State<double>& after, double length, int a, int b) const {
  constexpr double kLittle = 0.3;
  for (const int body : {a, b}) {
    const double omega =
        std::max(std::abs(before.twist[3 * body + 2]), std::abs(after.twist[3 * body + 2]));
    const BodyIndex& index = model.structure->bodies[body];
    const bool is_circle = index.shape == ShapeType::kCircle && index.num_contact_points == 0;
    double little = kLittle;
    if (index.shape == ShapeType::kEllipse) {
      const double* radii = model.Shape(body).numbers;
      little *= std::min(radii[0], radii[1]) / std::max(radii[0], radii[1]);
    }
    if (!is_circle && omega * length > little) {
      return false;
    }
  }
  double speed = 0.0;
  for (const State<double>* state : {&before, &after}) {
    speed = std::max(speed, std::hypot(state->twist[3 * a] - state->twist[3 * b],
                                       state->twist[3 * a + 1] - state->twist[3 * b + 1]));
  }
  const double size = lengths_.Size(a, b);
  return size == 0.0 || speed * length < size;
}

// From a start at which a pair touches and separates with `speed`: a time by which it has left and
// not yet returned.
double EventSearch::TouchStart(double speed, double acceleration) const {
  const double start = speed > 0.0 && acceleration > 0.0 ? 0.5 * speed / acceleration : kInfinity;
  const double sixteenth = segment_->length / 16.0;
  return speed <= slow_ ? sixteenth : std::min(start, 1e9);
}

void EventSearch::SearchReturn(const Model<double>& model, const ActiveContact& contact,
                               double touch, Event* event) {
  const double length = event->length;
  // Positive while the contact separates or has left: a length, in which the speed is multiplied by
  // the duration of the segment.
  const auto apart = [&](const Sample& sample) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    double speed;
    const double gap = GapAndSpeed(model, sample.motion.after, contact, &speed);
    return std::max(gap, length * speed);
  };
  const double tolerance = length * slow_;
  double a = 0.0;
  double speed;
  GapAndSpeed(model, segment_->before, contact, &speed);
  double fa = length * speed;
  // A correction of poses or twists may reverse the speed: the contact then returns at once,
  // whatever changes the start.
  if (fa > tolerance && apart(*At(model, 0.0)) < -tolerance) {
    event->kind = EventKind::kAtOnce;
    event->length = 0.0;
    event->contact = contact;
    return;
  }
  for (const double share : {0.125, 0.25, 0.5, 1.0}) {
    const double b = share * length;
    const double fb = apart(*At(model, b));
    if (std::isnan(fb)) {
      return;
    }
    if (fa > tolerance && fb < -tolerance) {
      const double root = Refine(
          model, apart,
          std::min(kLocatedOfSize * fa, GapTolerance(segment_->before, contact.a, contact.b)), a,
          fa, b, fb);
      const double gap = GapAndSpeed(model, At(model, root)->motion.after, contact, &speed);
      event->kind = gap < -touch ? EventKind::kReturn : EventKind::kTouch;
      event->length = root;
      event->contact = contact;
      return;
    }
    a = b;
    fa = std::max(fb, 0.0);
  }
}

void EventSearch::SearchLimit(const Model<double>& model, int joint, double side, Event* event) {
  ActiveContact limit;
  limit.a = model.structure->joints[joint].a;
  limit.b = model.structure->joints[joint].b;
  limit.joint = joint;
  limit.side = side;
  limit.law = ContactLaw::kInelastic;
  if (Contains(segment_->contacts, limit)) {
    return;
  }
  const auto evaluate = [&](const State<double>& state, double* rate) {
    return GapAndSpeed(model, state, limit, rate);
  };
  const double touch = TouchTolerance(model, segment_->before, limit);
  double rate_before, rate_after;
  evaluate(segment_->before, &rate_before);
  const Sample& end = *At(model, event->length);
  if (!end.good) {
    return;
  }
  const State<double> after = end.motion.after;
  evaluate(after, &rate_after);
  double from = 0.0;
  double allowed = 0.0;
  for (const ActiveContact& contact : *touching_) {
    if (!contact.SameAs(limit)) {
      continue;
    }
    if (contact.gap < -kDeepTouches * touch) {
      SearchReturn(model, limit, touch, event);
      return;
    }
    from = TouchStart(rate_before, 2.0 * std::abs(rate_after - rate_before) / event->length);
    allowed = std::max(touch, touch - contact.gap);
  }
  const double rate = 1.1 * std::max(std::abs(rate_before), std::abs(rate_after)) +
                      0.25 * std::abs(rate_after - rate_before);
  const bool touches = allowed > 0.0;
  const double slow = SpeedTolerance(model, segment_->before);
  // As for a pair's contacts: a limit that has touched all the time returns only if it approaches.
  const auto gap = [&](const Sample& sample) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    double speed;
    const double value = evaluate(sample.motion.after, &speed) + allowed;
    const bool cut = touches && value <= 0.0 && speed >= -slow &&
                     -value <= CutByPoses(model, sample.motion, sample.length, limit);
    return cut ? touch : value;
  };
  const auto rate_over = [&](double, double) { return rate; };
  const auto course_over = [&](double x, double fx, double y, double fy) {
    double rate_x, rate_y;
    const bool is_gap = evaluate(At(model, x)->motion.after, &rate_x) + allowed == fx &&
                        evaluate(At(model, y)->motion.after, &rate_y) + allowed == fy;
    return is_gap && MovesLittle(model, segment_->before, after, y - x, limit.a, limit.b)
               ? KnownCourse{CourseOf(y - x, fx, rate_x, fy, rate_y), rate_x, rate_y}
               : KnownCourse();
  };
  double root;
  if (from < event->length &&
      FirstRoot(model, gap, rate_over, course_over, 0.0, from, event->length, &root)) {
    double unused;
    const double depth = -evaluate(At(model, root)->motion.after, &unused);
    event->kind = touches && depth > kDeepTouches * touch ? EventKind::kReturn : EventKind::kTouch;
    event->length = root;
    event->contact = limit;
  }
}

}  // namespace tangible
