// SPDX-License-Identifier: Apache-2.0
//
// The modes of a motion: of its contacts, and of its supports, whose friction and the contacts'
// forces determine each other.
#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// How often in a step bodies that hold together are let go at the instant until which they do.
constexpr int kMostShareEnds = 20;

}  // namespace

bool EventStepper::ChooseModes(const Model<double>& model, const State<double>& state,
                               StepReport* outcome, Segment* segment) {
  const double slow = SlowSpeed(model, state);
  segment->contacts.clear();
  segment->friction.clear();
  segment->modes.clear();
  std::vector<double> slip;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    bool is_open = touching_.approach[i] > slow;
    const double counted = SlipAtStart(i, slow, &is_open);
    if (!is_open && !LacksItsContact(i, segment->contacts)) {
      segment->contacts.push_back(touching_.contacts[i]);
      segment->friction.push_back(touching_.friction[i]);
      slip.push_back(counted);
    }
  }
  if (model.structure->supports.empty()) {
    return ChooseContactModes(model, slow, std::move(slip), outcome, segment);
  }
  listed_contacts_ = segment->contacts;
  listed_friction_ = segment->friction;
  supports_.Begin(model, slow, segment);
  // Bodies that come to rest on their supports leave a joint between them the rounding of their
  // speeds; a motor's friction is about a speed that they do not have.
  for (size_t i = 0; i < slip.size(); ++i) {
    const ActiveContact& contact = listed_contacts_[i];
    if (!contact.is_motor && supports_.IsAtRest(model, segment->before, contact.a) &&
        supports_.IsAtRest(model, segment->before, contact.b)) {
      slip[i] = 0.0;
    }
  }
  for (;;) {
    if (!ChooseContactModes(model, slow, slip, outcome, segment)) {
      if (!supports_.LetGo(model, &segment->before)) return false;
      outcome->message.clear();
      segment->contacts = listed_contacts_;
      segment->friction = listed_friction_;
      segment->modes.clear();
      continue;
    }
    bool solved = flow_.Accelerate(model, *segment, segment->before, segment->time, &start_);
    const std::vector<ContactMode> modes = segment->modes;
    const bool limited = solved && LimitJointFriction(segment);
    if (limited) {
      solved = flow_.Accelerate(model, *segment, segment->before, segment->time, &start_);
    }
    const bool accepted =
        solved && supports_.Accept(model, start_.problem, start_.solution, segment);
    if (limited) segment->modes = modes;
    if (accepted && limited) {
      solved = flow_.Accelerate(model, *segment, segment->before, segment->time, &start_);
    }
    if (accepted && solved) break;
    const bool goes_on = solved && supports_.GoOnInstead(model, &segment->before);
    if (!solved || (supports_.has_given_up() && !goes_on)) {
      outcome->message = "accelerations";
      if (supports_.unsettled() >= 0) {
        const SupportIndex& support = model.structure->supports[supports_.unsettled()];
        outcome->message += ": the friction of the support of body " +
                            model.structure->bodies[support.body].name + " does not settle";
      }
      return false;
    }
    // What is held has no speed, before its forces are sought: where joints and supports hold a
    // body together their rows contradict each other by the rounding of its speed.
    if (supports_.HasToStop(model, *segment) && !supports_.HoldsStarting(*segment)) return true;
    segment->contacts = listed_contacts_;
    segment->friction = listed_friction_;
    segment->modes.clear();
  }
  supports_.Shorten(model, &start_, segment);
  return true;
}

// Where a joint's friction and a support hold a body together, any share of the one does, also one
// beyond its limit. The support is judged by what it has to hold where the joint is at its limit.
bool EventStepper::LimitJointFriction(Segment* segment) const {
  bool any = false;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    const double tangent = start_.solution.tangent_impulse[i];
    const double limit = start_.problem.contacts[i].friction * start_.solution.normal_impulse[i];
    if (!segment->contacts[i].IsJointFriction() || segment->modes[i] != ContactMode::kSticking ||
        std::abs(tangent) <= (1.0 + kForceTolerance) * limit) {
      continue;
    }
    segment->modes[i] =
        tangent > 0.0 ? ContactMode::kSlidingNegative : ContactMode::kSlidingPositive;
    any = true;
  }
  return any;
}

bool EventStepper::HoldsAfter(const Model<double>& model, const Segment& segment, double length) {
  const State<double>* const after = search_.StateAfter(model, length);
  if (after == nullptr) return true;
  trial_.time = segment.time + length;
  trial_.length = segment.length;
  trial_.middle = segment.middle;
  trial_.starts = false;
  trial_.before = *after;
  TakeHeldSpeeds(*model.structure, segment.before.supports, &trial_.before.twist);
  trial_.before.servo_modes.clear();
  trial_.before.supports.clear();
  trial_supports_ = supports_;
  trial_guess_ = guess_;
  supports_.Moved(true);
  FindTouching(model, trial_.before);
  StepReport unused;
  const bool chosen = ChooseModes(model, trial_.before, &unused, &trial_) && unused.message.empty();
  bool holds = true;
  for (size_t k = 0; chosen && k < segment.before.supports.size(); ++k) {
    holds = holds && (segment.before.supports[k].holds == SupportState::kNothing ||
                      trial_.before.supports[k].holds == segment.before.supports[k].holds);
  }
  std::swap(supports_, trial_supports_);
  std::swap(guess_, trial_guess_);
  FindTouching(model, segment.before);
  return holds;
}

// Bodies at rest that touch, or that joints connect, hold together what the support of one could
// not, and no function of one share tells when that ends. As the load grows it is decided after a
// motion as it was before it. What lets go has no acceleration yet, so that derivatives do not
// depend on the instant: it is given, as that of a signal's corner.
bool EventStepper::EndWhereShareEnds(const Model<double>& model, Segment* segment,
                                     std::string* message) {
  const EventKind event = segment->event;
  const bool changes_supports =
      event == EventKind::kSupportStops || event == EventKind::kSupportLetsGo;
  if (!search_.lets_go_with_others() || search_.ends_at_start() || changes_supports ||
      event == EventKind::kTouch || times_share_ended_ >= kMostShareEnds ||
      HoldsAfter(model, *segment, segment->length)) {
    return true;
  }
  ++times_share_ended_;
  const double whole = segment->length;
  double low = 0.0, high = whole;
  while (high - low > kShareEnds * whole) {
    const double middle = 0.5 * (low + high);
    (HoldsAfter(model, *segment, middle) ? low : high) = middle;
  }
  segment->length = high;
  segment->middle = segment->time + 0.5 * high;
  return search_.Run(model, touching_.contacts, segment, message);
}

void TakeHeldSpeeds(const ModelStructure& structure, const std::vector<SupportState>& supports,
                    std::vector<double>* twist) {
  for (size_t k = 0; k < supports.size(); ++k) {
    const bool centre = structure.supports[k].kind == SupportIndex::kCentre;
    const int held_rows = supports[k].holds == SupportState::kBody ? 3
                          : supports[k].holds >= 0 && centre       ? 2
                                                                   : 0;
    std::fill_n(twist->begin() + 3 * structure.supports[k].body, held_rows, 0.0);
  }
}

// What a support holds has no speed, not even the rounding that an event leaves.
bool EventStepper::StopSupports(const Model<double>& model, const Segment& segment, int parts,
                                State<double>* state, StepReport* outcome) {
  const ModelStructure& s = *model.structure;
  Segment held;
  held.time = segment.time;
  held.middle = segment.middle;
  held.contacts = segment.contacts;
  held.friction = segment.friction;
  held.modes = segment.modes;
  const std::vector<SupportState> supports = segment.before.supports;
  record_.num_parts = parts;
  EventPart* part = record_.Add();
  part->is_impulses = true;
  Impulses& stop = part->impulses;
  SetUpProjection(held, *state, &stop);
  stop.before.supports = supports;
  stop.holds = true;
  if (!flow_.Project(model, &stop)) {
    outcome->message = "twists of bodies that come to rest on their supports";
    return false;
  }
  const std::vector<double> before = state->twist;
  SpreadTwists(s, stop.solution.motion, &state->twist);
  TakeHeldSpeeds(s, supports, &state->twist);
  for (size_t k = 0; k < s.supports.size(); ++k) {
    // A joint may keep a body from turning about its held centre: what is left of its turn, or of
    // the speed that it lost, is rounding.
    const BodyIndex& body = s.bodies[s.supports[k].body];
    const size_t turn = 3 * static_cast<size_t>(s.supports[k].body) + 2;
    const double lever = std::sqrt(model.parameters[body.inertia] / model.parameters[body.mass]);
    const double speed = std::hypot(before[turn - 2], before[turn - 1], lever * before[turn]);
    const double left = std::abs(state->twist[turn]);
    const bool stops = supports[k].holds >= 0 && s.supports[k].kind == SupportIndex::kCentre &&
                       (lever * left <= kStoppedTurn * speed || left < kNoTurn);
    if (stops) state->twist[turn] = 0.0;
  }
  stop.new_twist = state->twist;
  supports_.Stopped();
  return true;
}

}  // namespace tangible
