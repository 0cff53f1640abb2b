// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/events/event_search_inl.h"
#include "tangible/simulation/events/flush_corners.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// How often the motion may be evaluated in a step, for each event that a pair may have: an event
// takes about ten evaluations; one search over a motion whose rates cannot be used takes a
// thousand.
constexpr long kEvaluationsOfEvent = 1000;

// What turns the acceleration of a contact's points (m/s²) into its force, kg, or into the torque
// of friction in a joint that turns, kg m. A force that changes a speed within a step only by
// rounding counts as 0: where no force acts (no gravity, bodies that coast side by side) all
// computed forces are rounding.
double Inert(const Model<double>& model, const Lengths& lengths, const ActiveContact& contact) {
  const bool turns =
      contact.is_rolling || (contact.IsJointFriction() &&
                             model.structure->joints[contact.joint].type != JointType::kPrismatic);
  double inert = 0.0;
  for (const int body : {contact.a, contact.b}) {
    const BodyIndex& index = model.structure->bodies[body];
    if (index.block < 0) continue;
    const double size = lengths.size(body);
    inert = std::max(inert, !turns       ? model.parameters[index.mass]
                            : size > 0.0 ? model.parameters[index.inertia] / size
                                         : 0.0);
  }
  return inert;
}

// The largest of the loads and normal forces at the start of a motion, N.
double LargestForce(const Segment& motion) {
  const SolvedNode& start = motion.stages[0];
  double scale = 0.0;
  for (const double load : start.problem.load) {
    scale = std::max(scale, std::abs(load));
  }
  for (size_t k = 0; k < start.solution.normal_impulse.size(); ++k) {
    if (!motion.contacts[k].IsPureFriction()) {
      scale = std::max(scale, std::abs(start.solution.normal_impulse[k]));
    }
  }
  return scale;
}

// The speed at which a half-plane that turns sweeps over another body, by its distance, m/s.
double SweptSpeed(const Model<double>& model, const Lengths& lengths, const Segment& segment,
                  int half_plane, int other) {
  const State<double>& before = segment.before;
  const double turn =
      std::max(std::abs(before.twist[3 * half_plane + 2]),
               LargestGivenTurn(model, half_plane, segment.time, segment.time + segment.length));
  return turn * (std::hypot(before.pose[3 * half_plane] - before.pose[3 * other],
                            before.pose[3 * half_plane + 1] - before.pose[3 * other + 1]) +
                 lengths.radius(other));
}

}  // namespace

EventSearch::EventSearch(const Model<double>& model) : lengths_(model), flow_(model) {
  Retarget(model);
}

void EventSearch::Retarget(const Model<double>& model) {
  lengths_ = Lengths(model);
  flow_.Retarget(model);
  num_samples_ = 0;
  closing_.resize(model.structure->bodies.size());
  boxes_.resize(model.structure->bodies.size());
  reach_.resize(model.structure->bodies.size());
}

void EventSearch::StartStep(const Model<double>& model, double t, double h,
                            const State<double>& state) {
  evaluations_ = 0;
  keeps_starts_ = false;
  AllowEventsOf(1);
  load_speed_ = LoadSpeed(model, lengths_, t, h, state);
}

double EventSearch::SpeedTolerance(const Model<double>& model, const State<double>& state) const {
  double speed = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]) *
                 model.structure->settings.dt;
  double rounding = 0.0;
  for (int body = 0; body < model.structure->num_bodies(); ++body) {
    const double size = lengths_.radius(body);
    const double own = SpeedOf(&state.twist[3 * body], size);
    speed = std::max(speed, own);
    // A face is turned by the rounding of its gaps, and then has a small speed along its
    // neighbours' normals.
    if (own > 0.0 && size > 0.0) {
      const double turned = kTurnedFace * lengths_.Rounding(state, body, body) / size;
      rounding = std::max(rounding, turned * own);
    }
  }
  return std::max(kSlowShare * speed, kLoadShare * load_speed_) + rounding + kLeastSpeed;
}

namespace {

bool HasHeld(const std::vector<SupportState>& supports) {
  return std::any_of(supports.begin(), supports.end(),
                     [](const SupportState& at) { return at.holds != SupportState::kNothing; });
}

}  // namespace

void EventSearch::FindContacts(const Model<double>& model, const State<double>& state, double reach,
                               std::vector<ActiveContact>* contacts) {
  const ModelStructure& structure = *model.structure;
  contacts->clear();
  for (int body = 0; body < structure.num_bodies(); ++body) {
    boxes_[body] = BoxOf(model, body, state.PoseOf(body), 0.5 * reach);
  }
  broad_phase_.FindPairs(
      boxes_, [&](int i, int j) { return structure.MayCollide(i, j); }, &pairs_);
  for (const auto& [first, second] : pairs_) {
    const int a = first;
    const int b = second;
    const auto visit = [&](PartPair parts) {
      ContactFeature features[2];
      const int count =
          FindFeatures(model, a, state.PoseOf(a), b, state.PoseOf(b), parts, reach, features);
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
    };
    ForEachPartNear(model, a, state.PoseOf(a), boxes_[a], b, state.PoseOf(b), boxes_[b],
                    0.5 * reach, visit);
  }
}

EventSearch::Sample* EventSearch::At(const Model<double>& model, double length) {
  for (int i = 0; i < num_samples_; ++i) {
    if (samples_[i].length == length) {
      return &samples_[i];
    }
  }
  // The ends of a bracket are used again; older samples are not.
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
  sample.has_end = false;
  ++evaluations_;
  const SolvedNode* first =
      num_samples_ > 1 && samples_[0].good ? &samples_[0].motion.stages[0] : nullptr;
  sample.good = flow_.Run(model, &motion, &message_, first);
  if (!sample.good) {
    all_good_ = false;
    motion.after = segment_->before;
  }
  return &sample;
}

EventSearch::Sample* EventSearch::From(const Model<double>& model, double length) {
  if (length > 0.0 || segment_->contacts.size() < kLeastContactsByRates) return At(model, length);
  if (!has_start_) {
    has_start_ = start_.good = true;
    start_.length = start_.motion.length = 0.0;
    start_.motion.after = segment_->before;
  }
  return &start_;
}

// Moves the result of a sample's motion to the segment to which it belongs.
void EventSearch::TakeMotion(Sample* sample, Segment* segment) {
  Segment& motion = sample->motion;
  std::swap(segment->after, motion.after);
  std::swap(segment->stages, motion.stages);
  segment->num_stages = motion.num_stages;
  std::swap(segment->corrections, motion.corrections);
  segment->num_corrections = motion.num_corrections;
  segment->projects_twists = motion.projects_twists;
  std::swap(segment->projection, motion.projection);
  num_samples_ = 0;  // the sample's data have been moved
}

// The function of a closed contact whose sign tells that its mode ends.
double EventSearch::ModeValue(const Model<double>& model, Sample* sample, const Event& event) {
  if (!sample->good) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Segment& motion = sample->motion;
  if (event.kind == EventKind::kSlipEnds) {
    return SlidingSign(motion.modes[event.index]) *
           SpeedsOf(model, motion.after, motion.contacts[event.index]).slip;
  }
  const SolvedNode* const end = EndOf(model, sample);
  if (end == nullptr) return std::numeric_limits<double>::quiet_NaN();
  const SolvedNode& node = *end;
  const double normal = node.solution.normal_impulse[event.index];
  if (event.kind == EventKind::kLiftOff) {
    return normal;
  }
  return motion.FrictionLeft(event.index, motion.friction[event.index].value, event.sign,
                             node.solution);
}

// Whether the force of an event's function is determined at the start of a motion; the share of a
// redundant contact is not.
bool EventSearch::IsDetermined(const Event& event, SolvedNode* node) const {
  std::vector<double> seed(3 * static_cast<size_t>(node->system.num_blocks()), 0.0);
  const std::vector<int>& block_of = node->system.contact_block();
  const auto add = [&](size_t i, double of_normal, double of_tangent) {
    seed[3 * static_cast<size_t>(block_of[segment_->NormalOf(i)])] += of_normal;
    seed[3 * static_cast<size_t>(block_of[i]) + 1] = of_tangent;
  };
  if (event.kind == EventKind::kLiftOff) {
    add(static_cast<size_t>(event.index), 1.0, 0.0);
  }
  for (size_t i = 0; event.kind == EventKind::kSlipBegins && i < segment_->contacts.size(); ++i) {
    if (segment_->SticksWith(i, static_cast<size_t>(event.index))) {
      add(i, segment_->friction[event.index].value, -event.sign);
    }
  }
  return node->system.SolveTransposed(node->problem, node->solution.modes, seed.data(), 1) <=
         kDetermined;
}

// A function that is 0 as the motion starts: a normal force, friction that is at its limit, or the
// speed of a contact that begins to slide. Where it is positive for a while and negative later the
// mode ends between; where it is negative in all of the motion the mode ends at the start, which
// its value there cannot tell.
void EventSearch::TryStart(const Model<double>& model, double tolerance, Event trial,
                           Event* event) {
  const bool is_slip = trial.kind == EventKind::kSlipEnds;
  if (keeps_starts_) return;
  const double length = event->length;
  if (!is_slip) {
    // The last stage tells it for nearly all contacts that stay at their limit.
    const Segment& motion = At(model, length)->motion;
    const ContactSolution<double>& late = motion.stages[motion.num_stages - 1].solution;
    const double last = trial.kind == EventKind::kLiftOff
                            ? late.normal_impulse[trial.index]
                            : motion.FrictionLeft(trial.index, motion.friction[trial.index].value,
                                                  trial.sign, late);
    if (motion.num_stages > 1 && !(last < -tolerance)) return;
    // A solve, before the motions that follow: in a pile the share of a contact is often redundant.
    if (!IsDetermined(trial, &At(model, length)->motion.stages[0])) {
      lets_go_with_others_ = lets_go_with_others_ || has_held_;
      return;
    }
  }
  // Where bodies jam they are thrown about by much more than their loads, in motions that are given
  // up.
  const double loads = LoadAcceleration(At(model, length)->motion.stages[0].problem);
  double at_end = 0.0, value = 0.0;
  double beyond = length, f_beyond = 0.0;  // the earliest place where the function is negative
  for (const double share : {1.0, 0.5, 0.125, 0x1p-6, 0x1p-9}) {
    const double at = share * length;
    value = ModeValue(model, At(model, at), trial);
    if (std::isnan(value) || (share == 1.0 && !(value < -tolerance))) return;
    const double back = is_slip ? -value / (loads * at) : 0.0;
    if (back > kJams || (is_slip && share == 1.0 && back < kLeastBack)) return;
    if (value > tolerance) {
      const auto f = [&](Sample& sample) { return ModeValue(model, &sample, trial); };
      trial.length = Refine(model, f, kLocatedOfSize * value, at, value, beyond, f_beyond);
      *event = trial;
      return;
    }
    if (share == 1.0) at_end = value;
    if (value < -tolerance) {
      beyond = at;
      f_beyond = value;
    }
  }
  // A value that jumps at the start is rounding of bodies whose masses are far apart.
  if (value < 0.5 * at_end) return;
  trial.at_start = true;
  trial.length = length;
  *event = trial;
}

double SlipRate(const Model<double>& model, const State<double>& state, double time, double inside,
                const std::vector<double>& accelerations, const ActiveContact& contact) {
  ContactRows<double> rows;
  EvaluateActiveRows(model, state, contact, &rows);
  double rate = 0.0;
  const auto add = [&](int body, const RowPart<double>& row) {
    const int block = model.structure->bodies[body].block;
    for (int i = 0; block >= 0 && i < 3; ++i) rate += row[i] * accelerations[3 * block + i];
  };
  add(contact.a, rows.tangent_a);
  add(contact.b, rows.tangent_b);
  if (!model.structure->paths.empty()) {
    std::vector<double> given;
    GivenAccelerations(model, time, inside, &given);
    for (int i = 0; i < 3; ++i) {
      rate += rows.tangent_a[i] * given[3 * contact.a + i] +
              rows.tangent_b[i] * given[3 * contact.b + i];
    }
  }
  return rate;
}

double EventSearch::RateOfSlip(const Model<double>& model, const State<double>& state, double time,
                               const std::vector<double>& accelerations, const Event& event) const {
  return SlidingSign(segment_->modes[event.index]) * SlipRate(model, state, time, segment_->middle,
                                                              accelerations,
                                                              segment_->contacts[event.index]);
}

// Where a sliding speed that is positive at a and b falls below 0 between them, or may do so, by
// the cubic through its values and rates; else b. A joint that friction would stop may be set in
// motion again by an effort that grows within the motion.
double EventSearch::FindDip(const Model<double>& model, const Event& event, double a, double fa,
                            double b, double fb) {
  const double width = b - a;
  // The last stage is evaluated at the end of its motion.
  const auto rate_at_end = [&](double length) {
    const Segment& motion = At(model, length)->motion;
    return width * RateOfSlip(model, motion.after, segment_->time + length,
                              motion.stages[motion.num_stages - 1].solution.motion, event);
  };
  const double ra = a > 0.0
                        ? rate_at_end(a)
                        : width * RateOfSlip(model, segment_->before, segment_->time,
                                             At(model, b)->motion.stages[0].solution.motion, event);
  if (!(ra < 0.0)) return b;
  const double rb = rate_at_end(b);
  if (!(rb > 0.0)) return b;
  // fa + ra x + c2 x² + c3 x³, whose rate vanishes at the later of two places.
  const double c2 = 3.0 * (fb - fa) - 2.0 * ra - rb;
  const double c3 = 2.0 * (fa - fb) + ra + rb;
  const double root = std::sqrt(std::max(c2 * c2 - 3.0 * c3 * ra, 0.0));
  const double x = c2 > 0.0 ? -ra / (c2 + root) : (root - c2) / (3.0 * c3);
  if (!(x > 0.0 && x < 1.0)) return b;
  const double least = fa + (ra + (c2 + c3 * x) * x) * x;
  return least < kDipMargin * (rb - ra) ? a + x * width : b;
}

size_t EventSearch::FirstToEnd(const Model<double>& model, const Event& event) {
  const Sample& sample = *At(model, event.length);
  if (!sample.good) return 0;
  const Segment& motion = sample.motion;
  const ContactSolution<double>& start = motion.stages[0].solution;
  const ContactSolution<double>& late = motion.stages[motion.num_stages - 1].solution;
  size_t first = 0;
  double earliest = kInfinity;
  for (size_t i = 0; i < motion.contacts.size(); ++i) {
    const auto compare = [&](double from, double to) {
      if (!(from > 0.0 && to < 0.0)) return;
      const double share = from / (from - to);
      // What differs by rounding alone keeps the order of the contacts.
      if (share < (1.0 - kSameShare) * earliest) {
        earliest = share;
        first = i;
      }
    };
    const ActiveContact& contact = motion.contacts[i];
    if (const double sign = SlidingSign(motion.modes[i]); sign != 0.0) {
      compare(sign * SpeedsOf(model, motion.before, contact).slip,
              sign * SpeedsOf(model, motion.after, contact).slip);
    }
    if (!contact.IsPureFriction()) compare(start.normal_impulse[i], late.normal_impulse[i]);
    if (motion.modes[i] == ContactMode::kSticking && !motion.SticksWithEarlier(i)) {
      const double friction = motion.friction[i].value;
      for (const double sign : {1.0, -1.0}) {
        compare(motion.FrictionLeft(i, friction, sign, start),
                motion.FrictionLeft(i, friction, sign, late));
      }
    }
  }
  return first;
}

bool EventSearch::IsClearOfHalf(const Model<double>& model, const Event& trial, double at_start,
                                double length) {
  if (segment_->contacts.size() < kLeastContactsByRates) return false;
  Sample* const sample = At(model, length);
  const Segment& motion = sample->motion;
  if (!sample->good || motion.num_stages != NystromTableau::kMost) return false;
  const ContactSolution<double>& late = motion.stages[3].solution;
  double at_end = 0.0, half = 0.0;
  if (trial.kind == EventKind::kSlipEnds) {
    at_end = ModeValue(model, sample, trial);
    const double rate_a = RateOfSlip(model, segment_->before, segment_->time,
                                     motion.stages[0].solution.motion, trial);
    const double rate_b =
        RateOfSlip(model, motion.after, segment_->time + length, late.motion, trial);
    half = 0.5 * (at_start + at_end) + 0.125 * length * (rate_a - rate_b);
  } else {
    // The third stage is at half of the motion.
    const auto value = [&](const ContactSolution<double>& of) {
      return trial.kind == EventKind::kLiftOff
                 ? of.normal_impulse[trial.index]
                 : motion.FrictionLeft(trial.index, motion.friction[trial.index].value, trial.sign,
                                       of);
    };
    at_end = value(late);
    half = value(motion.stages[2].solution);
  }
  return at_end > 0.0 && half > kClearOfHalf * std::min(at_start, at_end);
}

// Whether SearchRelease tells it.
bool EventSearch::IsShared(const Model<double>& model, const Event& trial) {
  return shares_ && trial.kind != EventKind::kSlipEnds &&
         !IsDetermined(trial, &At(model, segment_->length)->motion.stages[0]);
}

// Takes the event of a closed contact, unless bodies at rest on their supports share its force with
// these: whether all of them hold is decided after the motion.
void EventSearch::TakeClosed(const Model<double>& model, const Event& trial, Event* event) {
  if (has_held_ && trial.kind != EventKind::kSlipEnds &&
      !IsDetermined(trial, &At(model, segment_->length)->motion.stages[0])) {
    lets_go_with_others_ = true;
  } else {
    *event = trial;
  }
}

void EventSearch::SearchClosed(const Model<double>& model, Event* event) {
  if (segment_->contacts.empty()) return;
  // Of few contacts a search in their order costs little.
  const size_t first = segment_->contacts.size() < kManyContacts ? 0 : FirstToEnd(model, *event);
  for (size_t k = 0; k < segment_->contacts.size() && !event->at_start; ++k) {
    const size_t i = k == 0 ? first : k - (k <= first ? 1 : 0);
    const ContactMode mode = segment_->modes[i];
    Event trial;
    trial.index = static_cast<int>(i);
    trial.contact = segment_->contacts[i];
    // Values are located to their rounding: that of the fastest point, or of the largest force.
    double located = kLocatedOfSize / kSlowShare * slow_;
    const auto try_function = [&](double at_start, double tolerance) {
      if (IsShared(model, trial)) return;
      if (at_start <= tolerance) {
        TryStart(model, tolerance, trial, event);
        return;
      }
      const auto f = [&](Sample& sample) { return ModeValue(model, &sample, trial); };
      const auto ends_between = [&](double a, double fa, double b, double fb) {
        trial.length = Refine(model, f, std::max(kLocatedOfSize * at_start, located), a, fa, b, fb);
        trial.at_once =
            trial.length < kShortestPart * b && f(*At(model, trial.length)) < -tolerance;
        TakeClosed(model, trial, event);
      };
      double a = 0.0;
      double fa = at_start;
      for (const double share : {0.5, 1.0}) {
        if (share < 1.0 && IsClearOfHalf(model, trial, at_start, event->length)) continue;
        const double b = share * event->length;
        const double fb = ModeValue(model, At(model, b), trial);
        if (std::isnan(fb)) return;
        if (fb < -tolerance) {
          ends_between(a, fa, b, fb);
          return;
        }
        const double dip =
            trial.kind == EventKind::kSlipEnds ? FindDip(model, trial, a, fa, b, fb) : b;
        if (const double least = dip < b ? f(*At(model, dip)) : 0.0; least < -tolerance) {
          ends_between(a, fa, dip, least);
          return;
        }
        // At the end of the motion the function has reached 0 to rounding: the event is there. The
        // next motion could not find it, because its function would start at 0.
        if (share == 1.0 && fb <= tolerance && event->kind != trial.kind) {
          trial.length = b;
          TakeClosed(model, trial, event);
          return;
        }
        a = b;
        fa = std::max(fb, 0.0);
      }
    };
    if (SlidingSign(mode) != 0.0) {
      trial.kind = EventKind::kSlipEnds;
      try_function(
          SlidingSign(mode) * SpeedsOf(model, segment_->before, segment_->contacts[i]).slip, slow_);
    }
    const Sample& end = *At(model, event->length);
    if (!end.good) return;
    const ContactSolution<double>& start = end.motion.stages[0].solution;
    const double scale = LargestForce(end.motion);
    located = kLocatedOfSize * scale;
    const double tolerance =
        std::max(kForceTolerance * scale, Inert(model, lengths_, segment_->contacts[i]) * slow_ /
                                              model.structure->settings.dt);
    if (!segment_->contacts[i].IsPureFriction()) {
      trial.kind = EventKind::kLiftOff;
      try_function(start.normal_impulse[i], tolerance);
    }
    if (mode == ContactMode::kSticking && !segment_->SticksWithEarlier(i)) {
      trial.kind = EventKind::kSlipBegins;
      for (const double sign : {1.0, -1.0}) {
        if (event->at_start) break;
        trial.sign = sign;
        try_function(segment_->FrictionLeft(i, segment_->friction[i].value, sign, start),
                     tolerance);
      }
    }
  }
}

// Ends the motion where a contact passes a flush corner whose points are parameters.
void EventSearch::SearchFlushCorners(const Model<double>& model, Event* event) {
  for (const ActiveContact& contact : segment_->contacts) {
    const FacePlace start = PlaceOnFace(model, segment_->before, contact);
    if (!start.is_found) continue;
    const double tolerance = GapTolerance(segment_->before, contact.a, contact.b);
    for (const bool at_end : {false, true}) {
      const double end = at_end ? start.to : start.from;
      const auto left = [&](const Sample& sample) {
        if (!sample.good) return std::numeric_limits<double>::quiet_NaN();
        const double along = PlaceOnFace(model, sample.motion.after, contact).along;
        return at_end ? end - along : along - end;
      };
      const double fa = at_end ? end - start.along : start.along - end;
      if (!std::isfinite(end) || !(fa > tolerance)) continue;
      const double fb = left(*At(model, event->length));
      if (!(fb < -tolerance)) continue;
      event->length = Refine(model, left, tolerance, 0.0, fa, event->length, fb);
      event->kind = EventKind::kStepEnd;
    }
  }
}

// A bound on the speed of a driven body within the segment; 0 of others.
double EventSearch::SpeedAlongPath(const Model<double>& model, int body, double radius) const {
  return LargestGivenSpeed(model, body, segment_->time, segment_->time + segment_->length, radius);
}

void EventSearch::FindPairs(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  const Sample& end = *At(model, segment_->length);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const double before = SpeedOf(&segment_->before.twist[3 * body], lengths_.radius(body));
    const double after =
        end.good ? SpeedOf(&end.motion.after.twist[3 * body], lengths_.radius(body)) : before;
    closing_[body] = LargestSpeedBetween(before, after);
    closing_[body] = std::max(closing_[body], SpeedAlongPath(model, body, lengths_.radius(body)));
    const double reach = closing_[body] * segment_->length +
                         kWiderBoxes * lengths_.smallest_radius() +
                         lengths_.Rounding(segment_->before, body, body);
    reach_[body] = reach;
    boxes_[body] = BoxOf(model, body, segment_->before.PoseOf(body), reach);
    if (structure.bodies[body].shape == ShapeType::kHalfPlane &&
        (segment_->before.twist[3 * body + 2] != 0.0 || TurnsAlongPath(structure, body))) {
      boxes_[body] = {-kInfinity, -kInfinity, kInfinity, kInfinity};
    }
  }
  broad_phase_.FindPairs(
      boxes_, [&](int i, int j) { return structure.MayCollide(i, j); }, &pairs_);
  if (pairs_.size() > 1) SortPairs(model);
}

// Sorts pairs by the time at which the parabola through their gap and its rate at the start, and
// their gap at the end, closes: once the first event is found, the others are dismissed by its
// instant alone.
void EventSearch::SortPairs(const Model<double>& model) {
  const double h = segment_->length;
  const Sample& end = *At(model, h);
  if (!end.good) return;
  const auto closes_at = [&](int a, int b) {
    double first = kInfinity;
    ForEachNearPart(model, a, b, [&](PartPair parts) {
      ContactFeature features[2];
      if (FindFeatures(model, a, segment_->before.PoseOf(a), b, segment_->before.PoseOf(b), parts,
                       kInfinity, features) == 0) {
        return;
      }
      ActiveContact contact;
      contact.a = a;
      contact.b = b;
      contact.feature = features[0];
      ContactRows<double> rows;
      EvaluateContactRows(model, segment_->before, contact, &rows);
      const double gap = rows.geometry.gap;
      const double rate = RelativeSpeed(segment_->before, a, rows.normal_a, b, rows.normal_b);
      EvaluateContactRows(model, end.motion.after, contact, &rows);
      const double last = rows.geometry.gap;
      if (!(last < 0.0)) return;
      // gap + rate h x + c x² = 0 for x in (0, 1).
      const double c = last - gap - rate * h;
      const double root = std::sqrt(std::max(rate * h * rate * h - 4.0 * gap * c, 0.0));
      const double q = -0.5 * (rate * h + std::copysign(root, rate));
      for (const double x : {q != 0.0 ? gap / q : 0.0, c != 0.0 ? q / c : 0.0}) {
        if (x > 0.0) first = std::min(first, x);
      }
    });
    return first;
  };
  order_.clear();
  for (const auto& [a, b] : pairs_) order_.push_back({closes_at(a, b), {a, b}});
  std::sort(order_.begin(), order_.end());
  for (size_t i = 0; i < order_.size(); ++i) pairs_[i] = order_[i].second;
}

void EventSearch::SetEvent(const Event& event, Segment* segment) {
  segment->length = event.length;
  segment->event = event.kind;
  segment->event_contact = event.contact;
  segment->event_index = event.index;
  segment->event_sign = event.sign;
  segment->event_support = event.support;
  segment->release = event.release;
  segment->at_once = event.at_once;
  segment->hands_over = event.kind == EventKind::kTouch && event.length == event.hands_over_at;
  segment->passes = segment->hands_over && event.passes;
  segment->event_lost = event.lost;
  if (event.kind == EventKind::kSlipBegins && event.release.empty()) {
    segment->event_friction = segment->friction[event.index];
  }
}

bool EventSearch::Run(const Model<double>& model, const std::vector<ActiveContact>& touching,
                      Segment* segment, std::string* message) {
  segment_ = segment;
  touching_ = &touching;
  slow_ = SpeedTolerance(model, segment->before);
  num_samples_ = 0;
  has_start_ = false;
  all_good_ = true;
  lets_go_with_others_ = false;
  has_held_ = HasHeld(segment->before.supports);
  const long most = kEvaluationsOfEvent * num_pairs_with_events_ *
                    (1L + model.structure->settings.max_events_per_step);
  if (evaluations_ > most) {
    *message = "events are not found in " + std::to_string(most) +
               " evaluations of the motion: a body is too stiff for dt, or events do not end";
    return false;
  }
  Event event;
  event.length = segment->length;
  if (!At(model, event.length)->good) {
    *message = message_;
    return false;
  }
  FindPairs(model);
  for (const auto& [first, second] : pairs_) {
    const int a = first;
    const int b = second;
    for (const int body : {a, b}) {
      if (model.structure->bodies[body].shape == ShapeType::kHalfPlane) {
        closing_[body] = std::max(std::hypot(segment->before.twist[3 * body],
                                             segment->before.twist[3 * body + 1]),
                                  SpeedAlongPath(model, body, 0.0)) +
                         SweptSpeed(model, lengths_, *segment, body, body == a ? b : a);
      }
    }
    ForEachNearPart(model, a, b, [&](PartPair parts) {
      if (event.kind != EventKind::kAtOnce) {
        SearchPair(model, a, b, parts, &event);
      }
    });
    if (event.kind == EventKind::kAtOnce) {
      break;
    }
  }
  for (size_t j = 0; j < model.structure->joints.size(); ++j) {
    const JointIndex& joint = model.structure->joints[j];
    for (const double side : {1.0, -1.0}) {
      if (!HasLimit(model, segment->before, joint, side)) continue;
      if (event.kind != EventKind::kAtOnce) SearchLimit(model, static_cast<int>(j), side, &event);
    }
  }
  shares_ = event.kind != EventKind::kAtOnce && SharesChange(model, segment->length);
  if (event.kind != EventKind::kAtOnce) SearchClosed(model, &event);
  if (event.kind != EventKind::kAtOnce && !event.at_start) SearchRelease(model, &event);
  if (event.kind != EventKind::kAtOnce && !event.at_start) SearchServos(model, &event);
  if (event.kind != EventKind::kAtOnce && !event.at_start) SearchSupports(model, &event);
  if (event.kind != EventKind::kAtOnce && !event.at_start) SearchFlushCorners(model, &event);
  ends_at_start_ = event.at_start;
  SetEvent(event, segment);
  At(model, segment->length);
  // If a motion could not be integrated, the events that it would have met are unknown.
  if (!all_good_) {
    *message = message_;
    return false;
  }
  hand_overs_.clear();
  if (IsLocated(event.kind) && !event.at_start && !segment->contacts.empty()) {
    FindHandOvers(model, &event);
  }
  TakeMotion(At(model, segment->length), segment);
  if (event.kind == EventKind::kSlipBegins || event.kind == EventKind::kLiftOff ||
      event.kind == EventKind::kSupportLetsGo) {
    return flow_.Accelerate(model, *segment, segment->after, segment->time + segment->length,
                            &segment->end);
  }
  return true;
}

}  // namespace tangible
