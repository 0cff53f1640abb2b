// SPDX-License-Identifier: Apache-2.0
//
// The search for gaps that close: of pairs of bodies, and of joints to their limits.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/simulation/events/event_search_inl.h"

namespace tangible {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool OfPair(const ActiveContact& contact, int a, int b) {
  return contact.joint < 0 && contact.a == a && contact.b == b;
}

bool Contains(const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const ActiveContact& c) { return c.SameAs(contact); });
}

bool IsAmong(const ContactFeature* features, int count, const ContactFeature& feature) {
  return std::find(features, features + count, feature) != features + count;
}

// The gap of a contact or limit, and the speed at which it grows.
double GapAndSpeed(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact, double* speed) {
  ContactRows<double> rows;
  if (contact.joint >= 0) {
    const JointIndex& joint = model.structure->joints[contact.joint];
    JointRows<double> joint_rows;
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.numbers[joint.geometry], &joint_rows);
    EvaluateLimitRows(model, joint_rows, contact, &rows);
  } else {
    EvaluateContactRows(model, state, contact, &rows);
  }
  *speed = RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b);
  return rows.geometry.gap;
}

// A vertex that leaves an edge by its end is handed over when it meets the vertex there, and not at
// the gap of what takes over, whose edge has another end: that pair of vertices. `next` where the
// pair has none, or where rounded corners take over smoothly.
ActiveContact HandOver(const Model<double>& model, const State<double>& state,
                       const ActiveContact& lost, const ActiveContact& next) {
  constexpr double kAtEnd = 1e-6;  // of the edge
  const bool of_first = lost.feature.kind == FeatureKind::kVertexEdge;
  if (!of_first && lost.feature.kind != FeatureKind::kEdgeVertex) {
    return next;
  }
  const ShapeView<double> shapes[2] = {model.Shape(lost.a), model.Shape(lost.b)};
  if (CoreRadius(shapes[0]) > 0.0 || CoreRadius(shapes[1]) > 0.0) {
    return next;
  }
  const int edge = of_first ? lost.feature.b : lost.feature.a;
  const ShapeView<double>& with_edge = shapes[of_first ? 1 : 0];
  const int ends[2] = {edge, (edge + 1) % NumVertices(with_edge.type, with_edge.num_numbers)};
  const double length = (Vertex(with_edge, ends[0]) - Vertex(with_edge, ends[1])).norm();
  for (const int end : ends) {
    ActiveContact corners = next;
    corners.feature = {FeatureKind::kVertexVertex, of_first ? lost.feature.a : end,
                       of_first ? end : lost.feature.b};
    ContactRows<double> rows;
    EvaluateContactRows(model, state, corners, &rows);
    corners.gap = rows.geometry.gap;
    if (corners.gap <= kAtEnd * length) {
      return corners;
    }
  }
  return next;
}

}  // namespace

// Between two states of a pair `length` apart in time: whether neither turns by more than a third
// of a radian nor moves by more than the smaller one's size.
bool EventSearch::MovesLittle(const Model<double>& model, const State<double>& before,
                              const State<double>& after, double length, int a, int b) const {
  constexpr double kLittle = 0.3;
  for (const int body : {a, b}) {
    const double omega =
        std::max(std::abs(before.twist[3 * body + 2]), std::abs(after.twist[3 * body + 2]));
    if (model.structure->bodies[body].shape != ShapeType::kCircle && omega * length > kLittle) {
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

// How far apart the ends of two bodies' faces may be along them and count as one above the other,
// at least, m. A power of two as there (collide_core.cc).
double EventSearch::AlignedWithin(int a, int b) const {
  constexpr double kAligned = 8e-9;  // of the sum of the radii, which is at least half the faces'
  return std::ldexp(kAligned, std::ilogb(lengths_.radius(a) + lengths_.radius(b)));
}

// Whether a pair has moved since the segment's start by more than that.
bool EventSearch::HasPassed(const State<double>& state, int a, int b) const {
  constexpr double kPassed = 1e-7;  // of the smaller body
  const std::vector<double>& before = segment_->before.pose;
  const auto moved = [&](int k) {
    return std::abs(state.pose[3 * a + k] - before[3 * a + k] - state.pose[3 * b + k] +
                    before[3 * b + k]);
  };
  const double size = lengths_.Size(a, b);
  return moved(0) + moved(1) + moved(2) * size > kPassed * size + 2.0 * AlignedWithin(a, b);
}

// Whether one of the features found is another name of a closed contact: a vertex over a vertex,
// where rounding changes which of the two is told. It is handed over when they have parted.
bool EventSearch::Continues(const Model<double>& model, const State<double>& state,
                            const ActiveContact& contact, const ContactFeature* features,
                            int count) const {
  constexpr double kParallel = 1e-7;
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  const ContactGeometry<double> of_closed = rows.geometry;
  const double within = AlignedWithin(contact.a, contact.b);
  return std::any_of(features, features + count, [&](const ContactFeature& feature) {
    ActiveContact other = contact;
    other.feature = feature;
    EvaluateContactRows(model, state, other, &rows);
    return (rows.geometry.point - of_closed.point).norm() <= within &&
           (rows.geometry.normal - of_closed.normal).norm() <= kParallel;
  });
}

// From a start at which a pair touches and separates with `speed`: a time by which it has left and
// not yet returned.
double EventSearch::TouchStart(const Model<double>& model, double speed,
                               double acceleration) const {
  const double start = speed > 0.0 && acceleration > 0.0 ? 0.5 * speed / acceleration : kInfinity;
  const double sixteenth = segment_->length / 16.0;
  return speed <= SpeedTolerance(model, segment_->before) ? sixteenth : std::min(start, 1e9);
}

void EventSearch::SearchPair(const Model<double>& model, int a, int b, Event* event) {
  const auto is_closed = [&](const ActiveContact& c) { return Contains(segment_->contacts, c); };
  bool closed = false;
  for (const ActiveContact& contact : segment_->contacts) {
    closed = closed || OfPair(contact, a, b);
  }
  const double touch = lengths_.Touch(segment_->before, a, b);
  const double located = GapTolerance(segment_->before, a, b);
  const auto is_deep = [&](const ActiveContact& c) {
    return std::any_of(touching_->begin(), touching_->end(), [&](const ActiveContact& other) {
      return other.gap < -kDeepTouches * touch && other.SameAs(c);
    });
  };
  const double slow = SpeedTolerance(model, segment_->before);
  ActiveContact nearest;
  Vector2<double> normal(0.0, 0.0);
  bool on_face = false;  // the normal belongs to a body's face, not to the line between two points
  // The smallest gap of the pair's contacts that are not closed; those that touch and leave count
  // only if `all`, and never where they are in penetration: they return by their speed.
  const auto gap = [&](const Sample& sample, bool all, bool handed_over = false) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const State<double>& state = sample.motion.after;
    ContactFeature features[2];
    const int count = FindContactFeatures(model.Shape(a), state.PoseOf(a), model.Shape(b),
                                          state.PoseOf(b), kInfinity, features);
    // What takes over from a closed contact whose feature is the closest no longer: the search for
    // that finds it, whose gap is rounding.
    const bool hands_over =
        closed && !handed_over &&
        std::any_of(segment_->contacts.begin(), segment_->contacts.end(), [&](const auto& c) {
          return OfPair(c, a, b) && !IsAmong(features, count, c.feature);
        });
    double smallest = kInfinity;
    for (int k = 0; k < count; ++k) {
      ActiveContact contact;
      contact.a = a;
      contact.b = b;
      contact.feature = features[k];
      contact.law = ContactLaw::kInelastic;
      ContactRows<double> rows;
      EvaluateContactRows(model, state, contact, &rows);
      if (rows.geometry.gap < smallest && !is_closed(contact) &&
          (all ? !is_deep(contact) : !Contains(*touching_, contact)) &&
          !(hands_over && std::abs(rows.geometry.gap) <= touch && !Contains(*touching_, contact))) {
        smallest = rows.geometry.gap;
        nearest = contact;
        nearest.gap = smallest;
        normal = rows.geometry.normal;
        on_face = contact.feature.kind != FeatureKind::kVertexVertex;
      }
    }
    return smallest;
  };
  // Bound on how fast the gap closes over an interval: all points' speeds; where both ends have the
  // same face, the speed along its normal and what rotation adds.
  const auto rate_over = [&](double from, double to, bool all) {
    const double any = closing_[a] + closing_[b];
    const Sample& first = *At(model, from);
    if (!std::isfinite(gap(first, all))) {
      return any;
    }
    const ActiveContact start = nearest;
    const Vector2<double> along(normal.x(), normal.y());  // the next call moves it
    const bool face = on_face;
    const State<double> before = first.motion.after;
    const Sample& last = *At(model, to);
    if (!face || !std::isfinite(gap(last, all)) || !(nearest.feature == start.feature)) {
      return any;
    }
    const State<double>& after = last.motion.after;
    double closing = 0.0;
    double speed = 0.0;
    double turning = 0.0;
    for (const State<double>* state : {&before, &after}) {
      const Vector2<double> relative(state->twist[3 * a] - state->twist[3 * b],
                                     state->twist[3 * a + 1] - state->twist[3 * b + 1]);
      closing = std::max(closing, std::abs(along.dot(relative)));
      speed = std::max(speed, relative.norm());
      double turn = 0.0;
      double swept = 0.0;
      for (const int body : {a, b}) {
        const double omega = std::abs(state->twist[3 * body + 2]);
        const bool is_circle = model.structure->bodies[body].shape == ShapeType::kCircle;
        turn += is_circle ? 0.0 : omega;
        swept += is_circle ? 0.0 : omega * lengths_.radius(body);
      }
      closing = std::max(closing, std::abs(along.dot(relative)) + swept);
      turning = std::max(turning, turn);
    }
    return std::min(any, 1.05 * closing + 1.5 * turning * (to - from) * speed);
  };
  // Where the same features are closest at both ends and the bodies turn and move little between
  // them the gap's rate changes monotonically.
  const auto course_over = [&](double from, double fa, double to, double fb, double allowed,
                               bool all) {
    // Without a gap at both ends there is no contact whose rate it would be.
    Sample* const first = At(model, from);
    if (!std::isfinite(fa) || !std::isfinite(fb) || gap(*first, all) + allowed != fa) {
      return Course::kUnknown;
    }
    const ActiveContact start = nearest;
    const double rate_a = SpeedsOf(model, first->motion.after, start).normal;
    const State<double> before = first->motion.after;
    Sample* const last = At(model, to);
    if (gap(*last, all) + allowed != fb || !(nearest.feature == start.feature) ||
        !MovesLittle(model, before, last->motion.after, to - from, a, b)) {
      return Course::kUnknown;
    }
    return CourseOf(to - from, fa, rate_a, fb, SpeedsOf(model, last->motion.after, nearest).normal);
  };
  const auto search = [&](double from, double allowed, bool all) {
    if (from < event->length && gap(*At(model, from), all) > touch) {
      allowed = 0.0;  // it has left
    }
    // A contact that has touched all the time returns only by approaching: the first-order
    // integrator's poses may cut a corner that its twists do not.
    const auto shifted = [&](const Sample& sample) {
      const double value = gap(sample, all) + allowed;
      if (!std::isfinite(value)) {
        return value;
      }
      const bool approaches = value > 0.0 || !all || !Contains(*touching_, nearest) ||
                              SpeedsOf(model, sample.motion.after, nearest).normal < -slow;
      return approaches ? value : touch;
    };
    const auto rate = [&](double x, double y) { return rate_over(x, y, all); };
    const auto course = [&](double x, double fx, double y, double fy) {
      return course_over(x, fx, y, fy, allowed, all);
    };
    double root;
    if (from < event->length &&
        FirstRoot(model, shifted, rate, course, located, from, event->length, &root) &&
        root > 0.0) {
      event->length = root;
      const bool cut_in = gap(*At(model, root), all) < -kDeepTouches * touch;
      // Poses that cut a corner have passed the gap: it is the speed that turns.
      event->kind =
          cut_in && all && Contains(*touching_, nearest) ? EventKind::kReturn : EventKind::kTouch;
      event->contact = nearest;
    }
  };
  search(0.0, 0.0, false);
  // Contacts that touch and stay open leave first, and may return.
  double from = kInfinity;
  double allowed = touch;
  for (const ActiveContact& contact : *touching_) {
    if (OfPair(contact, a, b) && !is_closed(contact)) {
      if (contact.gap < -kDeepTouches * touch) {
        SearchReturn(model, contact, touch, event);
        if (event->kind == EventKind::kAtOnce) {
          return;
        }
      }
      const Sample& end = *At(model, event->length);
      const double speed = SpeedsOf(model, segment_->before, contact).normal;
      const double change =
          end.good ? std::abs(SpeedsOf(model, end.motion.after, contact).normal - speed) : 0.0;
      from = std::min(from, TouchStart(model, speed, 2.0 * change / event->length));
      allowed = std::max(allowed, touch - contact.gap);
    }
  }
  search(from, allowed, true);
  if (!closed) {
    return;
  }
  // A closed contact whose feature is no longer the pair's closest hands over to the next one.
  // Where corners meet it may not have been the closest as the segment starts: it is once they have
  // passed.
  const auto began_with = [&](const ContactFeature& feature) {
    ContactFeature at_start[2];
    const int count =
        FindContactFeatures(model.Shape(a), segment_->before.PoseOf(a), model.Shape(b),
                            segment_->before.PoseOf(b), kInfinity, at_start);
    return IsAmong(at_start, count, feature);
  };
  const ActiveContact* lost = nullptr;
  const auto same = [&](const Sample& sample) {
    const State<double>& state = sample.motion.after;
    ContactFeature features[2];
    const int count = FindContactFeatures(model.Shape(a), state.PoseOf(a), model.Shape(b),
                                          state.PoseOf(b), kInfinity, features);
    for (const ActiveContact& contact : segment_->contacts) {
      if (OfPair(contact, a, b) && !IsAmong(features, count, contact.feature) &&
          (HasPassed(state, a, b) || began_with(contact.feature)) &&
          !Continues(model, state, contact, features, count)) {
        lost = &contact;
        return -1.0;
      }
    }
    return 1.0;
  };
  if (same(*At(model, event->length)) < 0.0) {
    double low = 0.0;
    double high = event->length;
    while (high - low > 1e-14 * event->length) {
      const double m = 0.5 * (low + high);
      (same(*At(model, m)) < 0.0 ? high : low) = m;
    }
    if (high < event->length) {
      event->kind = EventKind::kTouch;
      event->length = high;
      const bool next = std::isfinite(gap(*At(model, high), true, true));
      same(*At(model, high));
      event->contact =
          HandOver(model, At(model, high)->motion.after, *lost, next ? nearest : *lost);
    }
  }
}

void EventSearch::SearchReturn(const Model<double>& model, const ActiveContact& contact,
                               double touch, Event* event) {
  const double length = event->length;
  // Above 0 while it separates or has left: a length, with the speed times that of the segment.
  const auto apart = [&](const Sample& sample) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    double speed;
    const double gap = GapAndSpeed(model, sample.motion.after, contact, &speed);
    return std::max(gap, length * speed);
  };
  const double tolerance = length * SpeedTolerance(model, segment_->before);
  double a = 0.0;
  double speed;
  GapAndSpeed(model, segment_->before, contact, &speed);
  double fa = length * speed;
  // A correction of poses or twists may turn it: it returns at once, whatever moves the start.
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
      const double root = Refine(model, apart,
                                 std::min(8.0 * std::numeric_limits<double>::epsilon() * fa,
                                          GapTolerance(segment_->before, contact.a, contact.b)),
                                 a, fa, b, fb);
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
    from = TouchStart(model, rate_before, 2.0 * std::abs(rate_after - rate_before) / event->length);
    allowed = std::max(touch, touch - contact.gap);
  }
  const double rate = 1.1 * std::max(std::abs(rate_before), std::abs(rate_after)) +
                      0.25 * std::abs(rate_after - rate_before);
  // As of a pair's contacts: a limit that has touched all the time returns only by approaching.
  // What poses cut off as the bodies turn by an angle is of its second order; corrections move them
  // too.
  const auto cut = [&](const Sample& sample) {
    const State<double>& at = sample.motion.after;
    const auto apart = [&](const std::vector<double>& of) {
      return std::hypot(of[3 * limit.a] - of[3 * limit.b],
                        of[3 * limit.a + 1] - of[3 * limit.b + 1]);
    };
    const double turn = sample.length * std::max(std::abs(at.twist[3 * limit.a + 2]),
                                                 std::abs(at.twist[3 * limit.b + 2]));
    double moved = turn * (turn * apart(at.pose) + sample.length * apart(at.twist));
    for (int k = 0; k < sample.motion.num_corrections; ++k) {
      for (const int body : {limit.a, limit.b}) {
        if (const int block = model.structure->bodies[body].block; block >= 0) {
          const double* by = &sample.motion.corrections[k].solution.v[3 * block];
          moved += std::hypot(by[0], by[1]) + std::abs(by[2]) * std::max(1.0, apart(at.pose));
        }
      }
    }
    return moved;
  };
  const bool touches = allowed > 0.0;
  const double slow = SpeedTolerance(model, segment_->before);
  const auto gap = [&](const Sample& sample) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    double speed;
    const double value = evaluate(sample.motion.after, &speed) + allowed;
    return touches && value <= 0.0 && speed >= -slow && -value <= cut(sample) ? touch : value;
  };
  const auto rate_over = [&](double, double) { return rate; };
  const auto course_over = [&](double x, double fx, double y, double fy) {
    double rate_x, rate_y;
    const bool is_gap = evaluate(At(model, x)->motion.after, &rate_x) + allowed == fx &&
                        evaluate(At(model, y)->motion.after, &rate_y) + allowed == fy;
    return is_gap && MovesLittle(model, segment_->before, after, y - x, limit.a, limit.b)
               ? CourseOf(y - x, fx, rate_x, fy, rate_y)
               : Course::kUnknown;
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
