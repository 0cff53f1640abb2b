// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/event_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/geometry/mass_properties.h"

namespace tangible {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A force counts as negative, and friction as exceeded, beyond this share of the forces at work.
constexpr double kForceTolerance = 1e-10;
constexpr int kMostHalvings = 1000;
constexpr int kMostRefinements = 200;

double SpeedOf(const double* twist, double radius) {
  return std::hypot(twist[0], twist[1]) + std::abs(twist[2]) * radius;
}

bool OfPair(const ActiveContact& contact, int a, int b) {
  return contact.joint < 0 && contact.a == a && contact.b == b;
}

bool Contains(const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const ActiveContact& c) { return c.SameAs(contact); });
}

double NormalSpeed(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact) {
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  return RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b);
}

double SlipSpeed(const Model<double>& model, const State<double>& state,
                 const ActiveContact& contact) {
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  return RelativeSpeed(state, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
}

}  // namespace

EventSearch::EventSearch(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  double smallest = kInfinity;
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const ShapeType type = structure.bodies[body].shape;
    const bool bounded = type != ShapeType::kNone && type != ShapeType::kHalfPlane;
    radius_.push_back(bounded ? BoundingRadius(model.Shape(body)) : 0.0);
    if (bounded) {
      smallest = std::min(smallest, radius_.back());
    }
  }
  scale_ = std::isfinite(smallest) ? smallest : 1.0;
  closing_.resize(structure.bodies.size());
  boxes_.resize(structure.bodies.size());
}

double EventSearch::TouchTolerance(const State<double>& state, int a, int b) const {
  double place = 0.0;
  for (const int body : {a, b}) {
    place = std::max({place, std::abs(state.pose[3 * body]), std::abs(state.pose[3 * body + 1])});
  }
  const double radius = radius_[a] > 0.0 && radius_[b] > 0.0 ? std::min(radius_[a], radius_[b])
                                                             : std::max(radius_[a], radius_[b]);
  return 1e-10 * radius + 64.0 * std::numeric_limits<double>::epsilon() * place;
}

double EventSearch::SpeedTolerance(const Model<double>& model, const State<double>& state) const {
  double speed =
      std::hypot(model.numbers[kGravityX], model.numbers[kGravityY]) * model.structure->settings.dt;
  for (int body = 0; body < model.structure->num_bodies(); ++body) {
    speed = std::max(speed, SpeedOf(&state.twist[3 * body], radius_[body]));
  }
  return 1e-11 * speed + 1e-200;
}

void EventSearch::FindContacts(const Model<double>& model, const State<double>& state, double reach,
                               std::vector<ActiveContact>* contacts) {
  const ModelStructure& structure = *model.structure;
  contacts->clear();
  for (int body = 0; body < structure.num_bodies(); ++body) {
    boxes_[body] = ComputeAabb(model.Shape(body), state.PoseOf(body), 0.5 * reach);
  }
  broad_phase_.FindPairs(
      boxes_, [&](int i, int j) { return structure.MayCollide(i, j); }, &pairs_);
  for (const auto& [a, b] : pairs_) {
    ContactFeature features[2];
    const int count = FindContactFeatures(model.Shape(a), state.PoseOf(a), model.Shape(b),
                                          state.PoseOf(b), reach, features);
    for (int k = 0; k < count; ++k) {
      ActiveContact contact;
      contact.a = a;
      contact.b = b;
      contact.feature = features[k];
      contact.law = ContactLaw::kInelastic;
      ContactRows<double> rows;
      EvaluateContactRows(model, state, contact, &rows);
      contact.gap = rows.geometry.gap;
      contacts->push_back(contact);
    }
  }
}

EventSearch::Sample* EventSearch::At(const Model<double>& model, double length) {
  for (int i = 0; i < num_samples_; ++i) {
    if (samples_[i].length == length) {
      return &samples_[i];
    }
  }
  // A bracket's ends are asked for again; older samples are not.
  constexpr int kMostSamples = 64;
  if (num_samples_ == kMostSamples) {
    std::rotate(samples_.begin(), samples_.begin() + kMostSamples / 2, samples_.end());
    num_samples_ = kMostSamples / 2;
  }
  if (samples_.empty()) {
    samples_.resize(kMostSamples);
  }
  Sample& sample = samples_[num_samples_++];
  sample.length = length;
  Segment& motion = sample.motion;
  motion.time = segment_->time;
  motion.length = length;
  motion.middle = segment_->middle;
  motion.before = segment_->before;
  motion.contacts = segment_->contacts;
  motion.friction = segment_->friction;
  motion.modes = segment_->modes;
  sample.good = flow_.Run(model, &motion, &message_);
  return &sample;
}

// Illinois' variant of the secant method within a bracket, with halving where it stalls: to the
// last bit that changes the value.
template <typename Function>
double EventSearch::Refine(const Model<double>& model, const Function& f, double a, double fa,
                           double b, double fb) {
  int same_side = 0;
  for (int k = 0; k < kMostRefinements && fb != 0.0; ++k) {
    const double width = b - a;
    if (width <= 4.0 * std::numeric_limits<double>::epsilon() * b) {
      break;
    }
    double m = k % 3 == 2 ? 0.5 * (a + b) : b - fb * width / (fb - fa);
    if (!(m > a && m < b)) {
      m = 0.5 * (a + b);
    }
    if (m == a || m == b) {
      break;
    }
    const double fm = f(*At(model, m));
    if (std::isnan(fm)) {
      break;
    }
    if (fm > 0.0) {
      a = m;
      fa = fm;
      if (++same_side > 1) fb *= 0.5;
    } else {
      b = m;
      fb = fm;
      same_side = 0;
    }
  }
  return b;
}

template <typename Gap, typename Rate>
bool EventSearch::FirstRoot(const Model<double>& model, const Gap& gap, const Rate& rate_over,
                            double from, double to, double* root) {
  struct Interval {
    double a, fa, b, fb;
  };
  const double smallest = 1e-12 * to;
  const double first = gap(*At(model, from));
  if (first <= 0.0) {
    *root = from;
    return from > 0.0;
  }
  std::vector<Interval> open = {{from, first, to, gap(*At(model, to))}};
  Interval crossing = open.back();  // the shortest known to hold a crossing
  for (int k = 0; !open.empty(); ++k) {
    const Interval i = open.back();
    open.pop_back();
    if (i.fb <= 0.0) {
      crossing = i;
    }
    if (k == kMostHalvings) {
      break;
    }
    if (std::isnan(i.fa) || std::isnan(i.fb)) {
      continue;
    }
    const double reach = i.b - i.a > smallest ? rate_over(i.a, i.b) * (i.b - i.a) : 0.0;
    if (i.fb > 0.0 && (i.fa + i.fb > reach || i.b - i.a <= smallest)) {
      continue;
    }
    // Where the gap closes at more than half of what the bound allows it does not open in between:
    // the crossing is the first.
    if (i.fb <= 0.0 && (i.b - i.a <= smallest || i.fa - i.fb > 0.5 * reach)) {
      *root = Refine(model, gap, i.a, i.fa, i.b, i.fb);
      return true;
    }
    const double m = 0.5 * (i.a + i.b);
    const double fm = gap(*At(model, m));
    if (fm > 0.0) {
      open.push_back({m, fm, i.b, i.fb});
    }
    open.push_back({i.a, i.fa, m, fm});
  }
  if (crossing.fb <= 0.0) {
    *root = Refine(model, gap, crossing.a, crossing.fa, crossing.b, crossing.fb);
    return true;
  }
  return false;
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
  const double touch = TouchTolerance(segment_->before, a, b);
  const double slow = SpeedTolerance(model, segment_->before);
  ActiveContact nearest;
  Vector2<double> normal(0.0, 0.0);
  bool on_face = false;  // the normal belongs to a body's face, not to the line between two points
  // The smallest gap of the pair's contacts that are not closed; those that touch and leave count
  // only if `all`.
  const auto gap = [&](const Sample& sample, bool all) {
    if (!sample.good) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const State<double>& state = sample.motion.after;
    ContactFeature features[2];
    const int count = FindContactFeatures(model.Shape(a), state.PoseOf(a), model.Shape(b),
                                          state.PoseOf(b), kInfinity, features);
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
          (all || !Contains(*touching_, contact))) {
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
    if (std::isinf(gap(first, all))) {
      return any;
    }
    const ActiveContact start = nearest;
    const Vector2<double> along = normal;
    const bool face = on_face;
    const State<double> before = first.motion.after;
    const Sample& last = *At(model, to);
    if (!face || std::isinf(gap(last, all)) || !(nearest.feature == start.feature)) {
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
        swept += is_circle ? 0.0 : omega * radius_[body];
      }
      closing = std::max(closing, std::abs(along.dot(relative)) + swept);
      turning = std::max(turning, turn);
    }
    return std::min(any, 1.05 * closing + 1.5 * turning * (to - from) * speed);
  };
  const auto search = [&](double from, double allowed, bool all) {
    if (from < event->length && gap(*At(model, from), all) > touch) {
      allowed = 0.0;  // it has left
    }
    // A contact that has touched all the time returns only by approaching: the first-order
    // integrator's poses may cut a corner that its twists do not.
    const auto shifted = [&](const Sample& sample) {
      const double value = gap(sample, all) + allowed;
      const bool approaches = value > 0.0 || !all || !Contains(*touching_, nearest) ||
                              NormalSpeed(model, sample.motion.after, nearest) < -slow;
      return approaches ? value : touch;
    };
    const auto rate = [&](double x, double y) { return rate_over(x, y, all); };
    double root;
    if (from < event->length && FirstRoot(model, shifted, rate, from, event->length, &root) &&
        root > 0.0) {
      event->kind = EventKind::kTouch;
      event->length = root;
      gap(*At(model, root), all);
      event->contact = nearest;
    }
  };
  search(0.0, 0.0, false);
  // Contacts that touch and stay open leave first, and may return.
  double from = kInfinity;
  double allowed = touch;
  for (const ActiveContact& contact : *touching_) {
    if (OfPair(contact, a, b) && !is_closed(contact)) {
      const Sample& end = *At(model, event->length);
      const double speed = NormalSpeed(model, segment_->before, contact);
      const double change =
          end.good ? std::abs(NormalSpeed(model, end.motion.after, contact) - speed) : 0.0;
      from = std::min(from, TouchStart(model, speed, 2.0 * change / event->length));
      allowed = std::max(allowed, touch - contact.gap);
    }
  }
  search(from, allowed, true);
  if (!closed) {
    return;
  }
  // A closed contact whose feature is no longer the pair's closest hands over to the next one.
  const auto same = [&](const Sample& sample) {
    const State<double>& state = sample.motion.after;
    ContactFeature features[2];
    const int count = FindContactFeatures(model.Shape(a), state.PoseOf(a), model.Shape(b),
                                          state.PoseOf(b), kInfinity, features);
    for (const ActiveContact& contact : segment_->contacts) {
      bool found = !OfPair(contact, a, b);
      for (int k = 0; k < count && !found; ++k) {
        found = features[k] == contact.feature;
      }
      if (!found) {
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
      gap(*At(model, high), true);
      event->contact = nearest;
    }
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
    const JointIndex& index = model.structure->joints[joint];
    JointRows<double> joint_rows;
    EvaluateJoint(index.type, state.PoseOf(index.a), state.PoseOf(index.b),
                  &model.numbers[index.geometry], &joint_rows);
    ContactRows<double> rows;
    EvaluateLimitRows(model, joint_rows, limit, &rows);
    *rate = RelativeSpeed(state, limit.a, rows.normal_a, limit.b, rows.normal_b);
    return rows.geometry.gap;
  };
  double rate_before, rate_after;
  evaluate(segment_->before, &rate_before);
  const Sample& end = *At(model, event->length);
  if (!end.good) {
    return;
  }
  evaluate(end.motion.after, &rate_after);
  double from = 0.0;
  double allowed = 0.0;
  if (Contains(*touching_, limit)) {
    from = TouchStart(model, rate_before, 2.0 * std::abs(rate_after - rate_before) / event->length);
    allowed = 1e-10;
  }
  const double rate = 1.1 * std::max(std::abs(rate_before), std::abs(rate_after)) +
                      0.25 * std::abs(rate_after - rate_before);
  const auto gap = [&](const Sample& sample) {
    double unused;
    return sample.good ? evaluate(sample.motion.after, &unused) + allowed
                       : std::numeric_limits<double>::quiet_NaN();
  };
  const auto rate_over = [&](double, double) { return rate; };
  double root;
  if (from < event->length && FirstRoot(model, gap, rate_over, from, event->length, &root)) {
    event->kind = EventKind::kTouch;
    event->length = root;
    event->contact = limit;
  }
}

// The function of a closed contact whose sign tells that its mode ends.
double EventSearch::ModeValue(const Model<double>& model, const Sample& sample,
                              const Event& event) {
  if (!sample.good) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Segment& motion = sample.motion;
  if (event.kind == EventKind::kSlipEnds) {
    return SlidingSign(motion.modes[event.index]) *
           SlipSpeed(model, motion.after, motion.contacts[event.index]);
  }
  if (!flow_.Accelerate(model, motion, motion.after, motion.time + motion.length, &node_)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const double normal = node_.solution.normal_impulse[event.index];
  if (event.kind == EventKind::kLiftOff) {
    return normal;
  }
  return motion.friction[event.index].value * normal -
         event.sign * node_.solution.tangent_impulse[event.index];
}

void EventSearch::SearchClosed(const Model<double>& model, Event* event) {
  const double slow = SpeedTolerance(model, segment_->before);
  for (size_t i = 0; i < segment_->contacts.size(); ++i) {
    const ContactMode mode = segment_->modes[i];
    Event trial;
    trial.index = static_cast<int>(i);
    trial.contact = segment_->contacts[i];
    const auto try_function = [&](double at_start, double tolerance) {
      if (at_start <= tolerance) {
        return;
      }
      double a = 0.0;
      double fa = at_start;
      for (const double share : {0.5, 1.0}) {
        const double b = share * event->length;
        const double fb = ModeValue(model, *At(model, b), trial);
        if (std::isnan(fb)) {
          return;
        }
        if (fb < -tolerance) {
          const auto f = [&](const Sample& sample) { return ModeValue(model, sample, trial); };
          trial.length = Refine(model, f, a, fa, b, fb);
          *event = trial;
          return;
        }
        a = b;
        fa = std::max(fb, 0.0);
      }
    };
    if (SlidingSign(mode) != 0.0) {
      trial.kind = EventKind::kSlipEnds;
      try_function(SlidingSign(mode) * SlipSpeed(model, segment_->before, segment_->contacts[i]),
                   slow);
    }
    const Sample& end = *At(model, event->length);
    if (!end.good) {
      return;
    }
    const ContactSolution<double>& start = end.motion.stages[0].solution;
    double scale = 0.0;
    for (const double momentum : end.motion.stages[0].problem.momentum) {
      scale = std::max(scale, std::abs(momentum));
    }
    for (const double normal : start.normal_impulse) {
      scale = std::max(scale, std::abs(normal));
    }
    const double normal = start.normal_impulse[i];
    const double tangent = start.tangent_impulse[i];
    trial.kind = EventKind::kLiftOff;
    try_function(normal, kForceTolerance * scale);
    if (mode == ContactMode::kSticking) {
      trial.kind = EventKind::kSlipBegins;
      const double limit = segment_->friction[i].value * normal;
      for (const double sign : {1.0, -1.0}) {
        trial.sign = sign;
        try_function(limit - sign * tangent, kForceTolerance * scale);
      }
    }
  }
}

void EventSearch::FindPairs(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  const Sample& end = *At(model, segment_->length);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const double before = SpeedOf(&segment_->before.twist[3 * body], radius_[body]);
    const double after =
        end.good ? SpeedOf(&end.motion.after.twist[3 * body], radius_[body]) : before;
    closing_[body] = 1.02 * std::max(before, after) + 0.25 * std::abs(after - before);
    const double reach = closing_[body] * segment_->length + 1e-9 * scale_;
    boxes_[body] = ComputeAabb(model.Shape(body), segment_->before.PoseOf(body), reach);
    if (structure.bodies[body].shape == ShapeType::kHalfPlane &&
        segment_->before.twist[3 * body + 2] != 0.0) {
      boxes_[body] = {-kInfinity, -kInfinity, kInfinity, kInfinity};
    }
  }
  broad_phase_.FindPairs(
      boxes_, [&](int i, int j) { return structure.MayCollide(i, j); }, &pairs_);
}

bool EventSearch::Run(const Model<double>& model, const std::vector<ActiveContact>& touching,
                      Segment* segment, std::string* message) {
  segment_ = segment;
  touching_ = &touching;
  num_samples_ = 0;
  Event event;
  event.length = segment->length;
  if (!At(model, event.length)->good) {
    *message = message_;
    return false;
  }
  FindPairs(model);
  for (const auto& [a, b] : pairs_) {
    double turning = 0.0;  // a turning half-plane sweeps by its distance
    for (const int body : {a, b}) {
      if (model.structure->bodies[body].shape == ShapeType::kHalfPlane) {
        const int other = body == a ? b : a;
        turning = std::abs(segment->before.twist[3 * body + 2]) *
                  (std::hypot(segment->before.pose[3 * a] - segment->before.pose[3 * b],
                              segment->before.pose[3 * a + 1] - segment->before.pose[3 * b + 1]) +
                   radius_[other]);
        closing_[body] =
            std::hypot(segment->before.twist[3 * body], segment->before.twist[3 * body + 1]) +
            turning;
      }
    }
    SearchPair(model, a, b, &event);
  }
  for (size_t j = 0; j < model.structure->joints.size(); ++j) {
    if (model.structure->joints[j].low >= 0) {
      SearchLimit(model, static_cast<int>(j), 1.0, &event);
      SearchLimit(model, static_cast<int>(j), -1.0, &event);
    }
  }
  SearchClosed(model, &event);
  const double length = event.length;
  segment->length = length;
  segment->event = event.kind;
  segment->event_contact = event.contact;
  segment->event_index = event.index;
  segment->event_sign = event.sign;
  if (event.kind == EventKind::kSlipBegins) {
    segment->event_friction = segment->friction[event.index];
  }
  if (!flow_.Run(model, segment, message)) {
    return false;
  }
  if (event.kind == EventKind::kSlipBegins || event.kind == EventKind::kLiftOff) {
    return flow_.Accelerate(model, *segment, segment->after, segment->time + length, &segment->end);
  }
  return true;
}

}  // namespace tangible
