// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_step.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/math/interrupt.h"
#include "tangible/simulation/events/crush.h"
#include "tangible/simulation/events/ellipse_motion.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/servo_bounds.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The shift of a sliding contact's tangential acceleration that keeps its direction of sliding, as
// a multiple of the accelerations that the acting forces cause.
constexpr double kForcedSlip = 1e4;
// How often it is made that many times larger where a light body between heavy ones is accelerated
// more by the friction of its contacts.
constexpr int kMostForced = 3;
// How often dt is halved for motions that ellipses shorten, and how many a contact may have in a
// step: a flat side of 1e-9 of the length of an ellipse takes 2000.
constexpr int kMostEllipseHalvings = 40;
constexpr int kMostEllipseMotions = 10000;
// How many motions that end before an event or a given time a step may have.
constexpr int kMostMotions = 30000;
// After more than this many times max_events_per_step events a step is given up.
constexpr int kGiveUp = 3;

double KineticEnergy(const Model<double>& model, const std::vector<double>& twist) {
  double energy = 0.0;
  for (const int body : model.structure->moving) {
    const BodyIndex& index = model.structure->bodies[body];
    const double* v = &twist[3 * body];
    energy += 0.5 * model.parameters[index.mass] * (v[0] * v[0] + v[1] * v[1]) +
              0.5 * model.parameters[index.inertia] * v[2] * v[2];
  }
  return energy;
}

// Sets the event of a segment that ended at a given time: a fraction of the rest of the step, which
// is an instant like a signal's corner; an edge; or else the end of the step. Returns how many
// events that is.
int EndAtGivenTime(bool is_shortened, const EdgeGroup& edges, Segment* segment) {
  if (!is_shortened && !edges.any) return 0;
  segment->event = EventKind::kEdge;
  if (is_shortened) return 0;
  segment->event_number = edges.window.number;
  return 1;
}

// Keeps the contacts that the modes hold closed.
void KeepClosed(const std::vector<ContactMode>& modes, double recovered, double slow,
                std::vector<double>* slip, Segment* segment) {
  size_t kept = 0;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    const bool rolls = segment->contacts[i].is_rolling;
    if (modes[i] == ContactMode::kOpen ||
        (rolls && (kept == 0 || !segment->contacts[kept - 1].RollsBy(segment->contacts[i])))) {
      continue;
    }
    segment->contacts[kept] = segment->contacts[i];
    ActiveContact& contact = segment->contacts[kept];
    contact.law = contact.gap < -recovered ? ContactLaw::kRecovery : ContactLaw::kInelastic;
    segment->friction[kept] = segment->friction[i];
    (*slip)[kept] = (*slip)[i];
    segment->modes.push_back(modes[i]);
    ++kept;
  }
  segment->contacts.resize(kept);
  segment->friction.resize(kept);
  // If one end of a face sticks, the other end does not slide, even if its share of the friction is
  // at the limit.
  for (size_t k = 0; k < kept; ++k) {
    const bool slides = SlidingSign(segment->modes[k]) != 0.0 && std::abs((*slip)[k]) <= slow;
    for (size_t i = 0; i < kept; ++i) {
      if (slides && segment->SticksWith(i, k)) {
        segment->modes[k] = ContactMode::kSticking;
      }
    }
  }
}

// Whether friction opposes the sliding of all joints that slide. That of a contact depends on its
// normal force, so that where it jams no shift makes it slide on.
bool OpposesSlips(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                  const std::vector<double>& slip, double slow) {
  for (size_t i = 0; i < modes.size(); ++i) {
    if (problem.contacts[i].limit_given && std::abs(slip[i]) > slow &&
        modes[i] != ContactMode::kOpen && !(SlidingSign(modes[i]) * slip[i] > 0.0)) {
      return false;
    }
  }
  return true;
}

// Number of events after which a step is given up.
int MostEvents(const Model<double>& model) {
  return kGiveUp * model.structure->settings.max_events_per_step + kGiveUp;
}

// Friction may hold bodies between others however hard these are pressed, where rebounds would have
// to move them: such an impact has impulses without rebounds alone. Whether it had any.
bool TakeRebounds(Impulses* impact, std::vector<bool>* rebounds) {
  if (std::find(rebounds->begin(), rebounds->end(), true) == rebounds->end()) return false;
  rebounds->assign(rebounds->size(), false);
  for (ActiveContact& contact : impact->contacts) {
    if (contact.law == ContactLaw::kRestitution) contact.law = ContactLaw::kInelastic;
  }
  return true;
}

}  // namespace

void SizeGuess(const ContactProblem<double>& problem, ContactSolution<double>* guess) {
  guess->modes.assign(problem.contacts.size(), ContactMode::kOpen);
  guess->normal_impulse.assign(problem.contacts.size(), 0.0);
  guess->tangent_impulse.assign(problem.contacts.size(), 0.0);
  guess->joint_impulse.assign(3 * problem.joints.size(), 0.0);
}

EventStepper::EventStepper(const Model<double>& model) : search_(model), flow_(model) {}

void EventStepper::Retarget(const Model<double>& model) {
  search_.Retarget(model);
  flow_.Retarget(model);
}

void EventGuess::Clear() {
  contacts.clear();
  modes.clear();
  broken_limits.clear();
  starts = true;
  located = 0;
  connected = false;
}

size_t EventGuess::bytes() const {
  return sizeof(ActiveContact) * contacts.capacity() + sizeof(ContactMode) * modes.capacity() +
         sizeof(BrokenLimit) * broken_limits.capacity();
}

ContactMode EventStepper::GuessOf(const ActiveContact& contact) const {
  for (size_t i = 0; i < guess_.contacts.size(); ++i) {
    if (guess_.contacts[i].SameAs(contact)) {
      return guess_.modes[i];
    }
  }
  return ContactMode::kSticking;
}

double EventStepper::ApproachOf(int group) const {
  double approach = 0.0;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    if (impacts_.Of(i) == group) approach = std::max(approach, -touching_.approach[i]);
  }
  return approach;
}

int EventStepper::NextToStrike(double slow) {
  const EventPart* last =
      record_.num_parts > 0 ? record_.parts[record_.num_parts - 1].get() : nullptr;
  const bool ends_in_touch =
      last != nullptr && !last->is_impulses && last->segment.event == EventKind::kTouch;
  int next = -1;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    if (!(touching_.approach[i] < -slow)) {
      continue;
    }
    const int group = impacts_.Of(i);
    const double struck = impacts_.Struck(group);
    if (struck > 0.0) {
      const double approach = ApproachOf(group);
      // A residual approach speed below the tolerance of the impact's solve must not start another
      // impact.
      if (approach >= 0.5 * struck && approach <= kSolvedApproach * slow) {
        continue;
      }
      return static_cast<int>(i);
    }
    const bool ended_segment = ends_in_touch && impacts_.Of(last->segment.event_contact) == group;
    next = next < 0 || ended_segment ? static_cast<int>(i) : next;
  }
  return next;
}

std::string EventStepper::EventsDoNotEnd(const Model<double>& model, const char* what,
                                         const ActiveContact& contact) {
  return std::string(what) + " do not end: more than " + std::to_string(MostEvents(model)) +
         " in a step of the " + NameOfContact(*model.structure, {contact}, 0) +
         ", max_events_per_step is " +
         std::to_string(model.structure->settings.max_events_per_step);
}

// Counts the contacts of the group that approach, each pair of bodies once.
bool EventStepper::CountImpact(const Model<double>& model, double slow, int group,
                               StepReport* outcome) {
  ++outcome->events;
  const ActiveContact* last = nullptr;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    const ActiveContact& contact = touching_.contacts[i];
    const bool same_pair = last != nullptr && last->a == contact.a && last->b == contact.b &&
                           last->joint == contact.joint;
    if (!(touching_.approach[i] < -slow) || impacts_.Of(i) != group || same_pair) {
      continue;
    }
    last = &contact;
    const int count = counts_.Add(contact);
    if (count == model.structure->settings.max_events_per_step + 1) {
      ++outcome->given_up.rebounds_given_up;
    }
    if (count > MostEvents(model)) {
      outcome->message = EventsDoNotEnd(model, "impacts", contact);
      return false;
    }
  }
  search_.AllowEventsOf(counts_.num_pairs());
  return true;
}

bool EventStepper::SolveImpacts(const Model<double>& model, double t, State<double>* state,
                                StepReport* outcome) {
  const auto find_touching = [&] {
    FindTouching(model, *state);
    const double slow = SlowSpeed(model, *state);
    impacts_.Connect(
        model, *state, t,
        {touching_.contacts, touching_.friction, touching_.restitution, touching_.approach}, slow);
    return slow;
  };
  impacts_.Begin(*model.structure);
  for (;;) {
    const double slow = find_touching();
    const int next = NextToStrike(slow);
    if (next < 0) {
      return true;
    }
    int group = impacts_.Of(static_cast<size_t>(next));
    const double approach = ApproachOf(group);
    if (impacts_.Struck(group) == 0.0) {
      const ActiveContact first = touching_.contacts[next];
      if (!LocateTouch(model, t, slow, group, state, outcome)) {
        return false;
      }
      find_touching();
      group = impacts_.Of(first);
      if (group < 0) continue;
    }
    const double struck = impacts_.Struck(group);
    const bool is_remainder = approach <= kRemainder * struck;
    impacts_.SetStruck(group, approach);
    if (!is_remainder && !CountImpact(model, slow, group, outcome)) {
      return false;
    }
    Impulses* impact = ListImpact(model, t, slow, group, *state, outcome);
    impact->remainder = is_remainder;
    if (!SolveImpact(model, impact, state, outcome)) {
      return false;
    }
  }
}

bool EventStepper::SolveImpact(const Model<double>& model, Impulses* impact, State<double>* state,
                               StepReport* outcome) {
  const SimulationSettings& settings = model.structure->settings;
  const auto solve = [&] {
    AssembleImpulses(model, &assembly_, impact);
    SizeGuess(impact->problem, &impact->solution);
    for (size_t i = 0; i < impact->contacts.size(); ++i) {
      impact->solution.modes[i] =
          impact->problem.contacts[i].has_friction ? ContactMode::kSticking : ContactMode::kClosed;
    }
    const ContactSolverReport report =
        solver_.Solve(impact->problem, SolverOptionsOf(settings), &impact->solution);
    CountSolve(report, outcome);
    return report;
  };
  ContactSolverReport solved = solve();
  if (!solved.solved && HoldsSlow(model, impact, state, outcome)) return true;
  if (!solved.solved && TakeRebounds(impact, &rebounds_)) {
    ++outcome->given_up.rebounds_given_up;
    solved = solve();
  }
  if (!solved.solved) {
    outcome->residual = solved.residual;
    outcome->message = "impact: " + WhatIsUnsolved(*model.structure, *impact, solved);
    const std::string who = WhoCannotYield(*model.structure, impact->contacts, impact->problem,
                                           solved.worst_contact, SolverOptionsOf(settings));
    if (!who.empty()) outcome->message += ": " + who;
    return false;
  }
  TakeRollingLimits(impact->solution, &impact->problem);
  solver_.system().MoveFactorsTo(&impact->system);
  const double before = KineticEnergy(model, state->twist);
  SpreadTwists(*model.structure, impact->solution.motion, &state->twist);
  impact->new_twist = state->twist;
  if (settings.impact_law != ImpactLaw::kNewton && !Decompress(model, *impact, state, outcome)) {
    return false;
  }
  outcome->impact_energy_gain =
      std::max(outcome->impact_energy_gain, KineticEnergy(model, state->twist) - before);
  return Settle(model, *impact, state, outcome);
}

// The guess is the last modes; contacts that slide keep sliding, because friction opposes the
// sliding whatever the accelerations are.
void EventStepper::GuessModes(const std::vector<ActiveContact>& contacts,
                              const std::vector<double>& slip, double slow,
                              ContactProblem<double>* problem,
                              ContactSolution<double>* solution) const {
  double scale = 0.0;
  for (size_t i = 0; i < problem->load.size(); ++i) {
    scale = std::max(scale, std::abs(problem->load[i]) / problem->mass[i]);
  }
  for (const ContactBlock<double>& contact : problem->contacts) {
    scale = std::max({scale, std::abs(contact.c_n), std::abs(contact.c_t)});
  }
  // The friction of a joint accelerates bodies by itself.
  scale = std::max(scale, LimitAcceleration(*problem));
  SizeGuess(*problem, solution);
  for (size_t i = 0; i < problem->contacts.size(); ++i) {
    ContactBlock<double>& contact = problem->contacts[i];
    ContactMode guess = GuessOf(contacts[i]);
    if (!contact.has_friction) {
      guess = guess == ContactMode::kOpen ? guess : ContactMode::kClosed;
    } else if (std::abs(slip[i]) > slow) {
      contact.c_t += (slip[i] > 0.0 ? kForcedSlip : -kForcedSlip) * std::max(scale, kNoScale);
      guess = guess == ContactMode::kOpen ? guess
              : slip[i] > 0.0             ? ContactMode::kSlidingPositive
                                          : ContactMode::kSlidingNegative;
    } else if (guess == ContactMode::kClosed) {
      guess = ContactMode::kSticking;
    }
    solution->modes[i] = guess;
  }
}

void EventStepper::ShortenAtEllipses(const Model<double>& model,
                                     const ContactSolution<double>& accelerations,
                                     StepReport* outcome, Segment* segment) {
  const EllipseMotion motion =
      LongestEllipseMotion(model, segment->before, segment->contacts, accelerations);
  if (!(segment->length > motion.longest)) return;
  const double dt = model.structure->settings.dt;
  double spacing = dt;
  for (int k = 1; k <= kMostEllipseHalvings && spacing > motion.longest; ++k) {
    spacing = std::ldexp(dt, -k);
  }
  const double next = (std::floor(segment->time / spacing + kSameInstant) + 1.0) * spacing;
  const double length = next - segment->time;
  if (length >= segment->length - kSameInstant * spacing) return;
  ++outcome->ellipse_motions;
  const ActiveContact& contact = segment->contacts[motion.contact];
  if (length > 0.0) {
    segment->length = length;
    segment->middle = segment->time + 0.5 * length;
  }
  if (shortened_.Add(contact) > kMostEllipseMotions || !(length > 0.0)) {
    outcome->message = "more than " + std::to_string(kMostEllipseMotions) +
                       " motions in a step, so short because an ellipse turns over its flat side "
                       "or tip: the " +
                       NameOfContact(*model.structure, {contact}, 0) +
                       " needs a smaller dt or a less slender ellipse";
  }
}

double EventStepper::SlipAtStart(size_t i, double slow, bool* is_open) const {
  double slip = touching_.slip[i];
  for (const std::vector<EndingSlip>* list : {&ending_, &released_}) {
    for (const EndingSlip& ending : *list) {
      if (!ending.contact.SameAs(touching_.contacts[i])) continue;
      *is_open = *is_open || ending.sign == 0.0;
      // The speed is set above the tolerance, because the contact does not slide yet against its
      // own friction.
      slip = 2.0 * slow * ending.sign;
    }
  }
  return slip;
}

bool EventStepper::ChooseContactModes(const Model<double>& model, double slow,
                                      std::vector<double> slip, StepReport* outcome,
                                      Segment* segment) {
  const SimulationSettings& settings = model.structure->settings;
  const State<double>& state = segment->before;
  if (segment->contacts.empty()) {
    guess_.contacts.clear();
    guess_.modes.clear();
    return true;
  }
  ContactProblem<double> problem;
  AssembleAcceleration(model, state, segment->time, segment->middle, segment->contacts,
                       segment->friction, &assembly_, &problem);
  AddEdgesToCome(model, *segment, &problem);
  ContactSolution<double> solution;
  GuessModes(segment->contacts, slip, slow, &problem, &solution);
  ContactSolverOptions options = SolverOptionsOf(settings);
  options.last_resort = !limited_;
  ContactSolverReport solved = solver_.Solve(problem, options, &solution);
  CountSolve(solved, outcome);
  double forced = 1.0;
  for (int k = 0;
       k < kMostForced && solved.solved && !OpposesSlips(problem, solution.modes, slip, slow);
       ++k) {
    forced *= kForcedSlip;
    AssembleAcceleration(model, state, segment->time, segment->middle, segment->contacts,
                         segment->friction, &assembly_, &problem);
    AddEdgesToCome(model, *segment, &problem);
    ContactProblem<double> own = problem;
    GuessModes(segment->contacts, slip, slow, &problem, &solution);
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      const double c_t = own.contacts[i].c_t;
      problem.contacts[i].c_t = c_t + forced * (problem.contacts[i].c_t - c_t);
    }
    solved = solver_.Solve(problem, options, &solution);
    CountSolve(solved, outcome);
  }
  const bool holds_unsolved = holds_ == Holds::kUnsolved && !solved.solved &&
                              solved.worst_contact >= 0 &&
                              std::abs(slip[solved.worst_contact]) <= HeldSpeed(model);
  if (holds_ == Holds::kAll || holds_unsolved) {
    HoldModes(problem, slip, HeldSpeed(model), &solution.modes);
    search_.KeepStarts(true);
    ++outcome->given_up.held_contacts;
  } else if (!solved.solved) {
    outcome->message = "accelerations";
    if (solved.worst_contact >= 0) {
      outcome->message +=
          ": " + NameOfContact(*model.structure, segment->contacts, solved.worst_contact);
    }
    return false;
  }
  // A contact without slip that slides by one share of the forces may stick by another.
  for (size_t i = 0; i < slip.size(); ++i) {
    if (SlidingSign(solution.modes[i]) != 0.0 && std::abs(slip[i]) <= slow) {
      inner_impulses_.Choose(problem, kDegenerateTolerance, &solution);
      break;
    }
  }
  for (size_t i = 0; i < slip.size(); ++i) {
    const bool rests = std::any_of(
        resting_.begin(), resting_.end(),
        [&](const ActiveContact& contact) { return contact.SameAs(segment->contacts[i]); });
    if (rests && SlidingSign(solution.modes[i]) != 0.0 && std::abs(slip[i]) <= slow) {
      solution.modes[i] = ContactMode::kSticking;
    }
  }
  OpenIdle(model, segment, &solution);
  guess_.contacts = segment->contacts;
  guess_.modes = solution.modes;
  ShortenAtEllipses(model, solution, outcome, segment);
  // In an instant penetration is decided with the step's length, so that rounding does not count.
  const double length = segment->length > 0.0 ? segment->length : settings.dt;
  KeepClosed(solution.modes, settings.recovery_speed * length, slow, &slip, segment);
  return true;
}

void EventStepper::SwitchMode(const Segment& segment) {
  if (!segment.release.empty()) {
    ReleaseTogether(segment);
    return;
  }
  for (size_t i = 0; i < guess_.contacts.size(); ++i) {
    // A body that stops does so at all its contacts; the speed of a contact tells whether it still
    // slides.
    if (segment.event == EventKind::kSlipEnds && SlidingSign(guess_.modes[i]) != 0.0) {
      guess_.modes[i] = ContactMode::kSticking;
    }
    if (segment.event == EventKind::kLiftOff && guess_.contacts[i].SameAs(segment.event_contact)) {
      guess_.modes[i] = ContactMode::kOpen;
    } else if (segment.event == EventKind::kSlipBegins && guess_.modes[i] != ContactMode::kOpen &&
               guess_.contacts[i].IsBetweenTheSame(segment.event_contact)) {
      // Both ends of a face slide against the force that was at its limit.
      guess_.modes[i] =
          segment.event_sign > 0.0 ? ContactMode::kSlidingNegative : ContactMode::kSlidingPositive;
    }
  }
}

bool EventStepper::EndOtherSlips(const Model<double>& model, double t, const Segment& segment,
                                 State<double>* state, StepReport* outcome) {
  const bool ends_slip = segment.event == EventKind::kSlipEnds;
  const double was_slow = search_.SpeedTolerance(model, segment.before);
  const auto ends = [&](size_t i, double slow) {
    const double sign = SlidingSign(segment.modes[i]);
    const ActiveContact& contact = segment.contacts[i];
    return sign != 0.0 && std::abs(SpeedsOf(model, *state, contact).slip) <= slow &&
           (ends_slip || sign * SpeedsOf(model, segment.before, contact).slip > was_slow);
  };
  if (!ends_slip) {
    // Few motions end with another event, and nearly none of these with a slip of 0.
    const double slow = search_.SpeedTolerance(model, *state);
    bool any = false;
    for (size_t i = 0; i < segment.contacts.size(); ++i) any = any || ends(i, slow);
    if (!any) return true;
  }
  FindTouching(model, *state);
  coupled_.Connect(*model.structure, touching_.contacts);
  const double slow = SlowSpeed(model, *state);
  const int group = coupled_.GroupOf(segment.event_contact);
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    if (coupled_.GroupOf(segment.contacts[i]) != group && ends(i, slow)) {
      ending_.push_back({segment.contacts[i], SlidingSign(segment.modes[i])});
    }
  }
  bool good = true;
  while (good && !ending_.empty()) {
    const ActiveContact next = ending_.front().contact;
    const int ends = coupled_.GroupOf(next);
    ++outcome->events;
    counts_.Add(next);
    good = AddInstant(model, t, EventKind::kSlipEnds, &next, state, outcome);
    std::erase_if(ending_, [&](const EndingSlip& ending) {
      return coupled_.GroupOf(ending.contact) == ends;
    });
    for (size_t i = 0; i < guess_.contacts.size(); ++i) {
      if (SlidingSign(guess_.modes[i]) != 0.0 && coupled_.GroupOf(guess_.contacts[i]) == ends) {
        guess_.modes[i] = ContactMode::kSticking;
      }
    }
  }
  ending_.clear();
  return good;
}

bool EventStepper::AddHandOvers(const Model<double>& model, double t, const Segment& segment,
                                State<double>* state, StepReport* outcome) {
  if (search_.hand_overs().empty()) return true;
  FindTouching(model, *state);
  coupled_.Connect(*model.structure, touching_.contacts);
  std::vector<EventSearch::HandOver> others = search_.hand_overs();
  std::erase_if(others, [&](const EventSearch::HandOver& one) {
    return coupled_.GroupOf(one.lost) == coupled_.GroupOf(segment.event_contact);
  });
  for (size_t k = 0; k < others.size(); ++k) {
    // The motion up to here had the contacts of before.
    FindTouching(model, *state);
    for (size_t j = k; j < others.size(); ++j) {
      for (size_t i = 0; i < touching_.contacts.size(); ++i) {
        const ActiveContact& contact = touching_.contacts[i];
        if (contact.IsBetweenTheSame(others[j].lost) && !contact.SameAs(others[j].lost)) {
          touching_.approach[i] = HUGE_VAL;
        }
      }
      AddTouching(model, *state, others[j].lost);
    }
    ++outcome->events;
    counts_.Add(others[k].next);
    if (!AddInstant(model, t, EventKind::kTouch, &others[k].next, state, outcome)) return false;
  }
  return true;
}

StepReport EventStepper::Step(const Model<double>& model, double t, double h, State<double>* state,
                              AtEvent at_event) {
  const FlowCounts own = flow_.counts();
  const FlowCounts searched = search_.flow_counts();
  StepReport outcome = Advance(model, t, h, at_event, state);
  outcome.solver.whole_system += flow_.counts().whole_system - own.whole_system +
                                 search_.flow_counts().whole_system - searched.whole_system;
  outcome.newton_stages =
      static_cast<int>(search_.flow_counts().newton_stages - searched.newton_stages);
  return outcome;
}

// Solves an instant: impacts, and corrections at the start of a run and the end of a step.
// `begins`: the step's start.
bool EventStepper::SolveInstant(const Model<double>& model, double now, double h, bool begins,
                                bool at_end, State<double>* state, StepReport* outcome) {
  if (!SolveImpacts(model, now, state, outcome)) {
    return false;
  }
  if (guess_.starts && !TurnJoints(model, now, state, outcome)) return false;
  if ((guess_.starts || at_end) &&
      !AddInstant(model, now, EventKind::kStepEnd, nullptr, state, outcome)) {
    return false;
  }
  if (begins) {
    const int limit = StuckLimit(model, *state, model.structure->settings.recovery_speed * h);
    if (limit >= 0) {
      outcome->message = NameOfContact(*model.structure, touching_.contacts, limit) +
                         " stays broken: another one contradicts it";
      return false;
    }
  }
  if (guess_.starts && !at_end) {
    // The projection has changed twists that the joints do not allow, so that other contacts may
    // slide, or in other directions.
    FindTouching(model, *state);
  }
  guess_.starts = false;
  return true;
}

// A new part of the record: motion from `now`, at most to `until`.
Segment& EventStepper::BeginSegment(double now, double until, const State<double>& state) {
  CheckInterrupt();
  EventPart* part = record_.Add();
  part->is_impulses = false;
  Segment& segment = part->segment;
  segment.time = now;
  segment.length = until - now;
  segment.starts = false;
  segment.middle = 0.5 * (now + until);
  segment.before = state;
  segment.event_number = -1;
  segment.at_once = segment.hands_over = segment.passes = false;
  segment.release.clear();
  segment.further_edges.clear();
  segment.edge_before = -1;
  return segment;
}

// The event that has ended `segment` at `now`: the modes after it, and its count, which is limited.
bool EventStepper::TakeEvent(const Model<double>& model, double now, double h,
                             const Segment& segment, State<double>* state, StepReport* outcome) {
  SwitchMode(segment);
  supports_.TakeEvent(segment);
  if (segment.event != EventKind::kTouch || segment.length <= kNoMotion * h) {
    ++outcome->events;
    if (counts_.Add(segment.event_contact) > MostEvents(model)) {
      outcome->message = EventsDoNotEnd(model, "events", segment.event_contact);
      return false;
    }
    search_.AllowEventsOf(counts_.num_pairs());
  }
  return EndOtherSlips(model, now, segment, state, outcome) &&
         AddHandOvers(model, now, segment, state, outcome);
}

// Chooses the modes of `segment`, the last part of the record, and moves along it. What cannot be
// moved is taken out of the record again and tried in another way: with the contacts that a start
// has released kept closed, after a short step with impulses, or over half the time.
EventStepper::Tried EventStepper::TryMotion(const Model<double>& model, double now, double h,
                                            State<double>* state, Tries* tries, StepReport* outcome,
                                            Segment* segment) {
  const int parts = record_.num_parts - 1;
  const auto keep_starts = [&] {
    record_.num_parts = parts;
    search_.KeepStarts(true);
    outcome->message.clear();
    released_.clear();
    return Tried::kAgain;
  };
  holds_ = tries->held ? Holds::kAll : tries->short_step ? Holds::kUnsolved : Holds::kNone;
  const bool chosen = ChooseModes(model, *state, outcome, segment);
  holds_ = Holds::kNone;
  if (!chosen) {
    if (!released_.empty()) return keep_starts();
    record_.num_parts = parts;
    if (std::exchange(tries->short_step, true)) {
      if (std::exchange(limited_, false)) {
        tries->short_step = false;
        outcome->message.clear();
        return Tried::kAgain;
      }
      if (!tries->unsolved.empty()) outcome->message = tries->unsolved;
      return Tried::kFailed;
    }
    outcome->message.clear();
    if (!SolveByShortStep(model, now, h, state, outcome)) {
      record_.num_parts = parts;
      tries->unsolved.swap(outcome->message);
      outcome->message.clear();
    }
    return Tried::kAgain;
  }
  if (!outcome->message.empty()) return Tried::kFailed;
  if (supports_.HasToStop(model, *segment)) {
    return StopSupports(model, *segment, parts, state, outcome) ? Tried::kAgain : Tried::kFailed;
  }
  if (!model.structure->servos.empty()) HoldServos(model, &flow_, segment);
  std::string message;
  bool moved = search_.Run(model, touching_.contacts, segment, &message) &&
               EndWhereShareEnds(model, segment, &message);
  // Where motions have to be shortened.
  if (moved && tries->halvings > 0 && GainsEnergy(model, *segment)) {
    moved = false;
    message = "a motion gains energy that no load gives it: dt is too large";
  }
  outcome->pairs_compared = search_.num_compared();
  outcome->pairs_near = search_.num_pairs();
  if (moved) return Tried::kMoved;
  if (!released_.empty()) return keep_starts();
  ++outcome->halved_motions;
  record_.num_parts = parts;
  if (!tries->Halve()) {
    outcome->message = message;
    const bool again =
        !std::exchange(tries->held, true) && HoldsTouching(model, now, state, outcome);
    tries->halvings = again ? 0 : tries->halvings;
    tries->halved_motions = 0;
    return again ? Tried::kAgain : Tried::kFailed;
  }
  search_.KeepStarts(true);  // contacts that jam keep their modes
  return Tried::kAgain;
}

// Forgets what belongs to the step before.
void EventStepper::BeginStep(const Model<double>& model, double t, double h,
                             const State<double>& state) {
  record_.Clear();
  guess_.located = 0;
  due_ = EdgeGroup();
  released_.clear();
  resting_.clear();
  jammed_.clear();
  // What supports hold while their friction is sought may have no accelerations.
  limited_ = !model.structure->supports.empty();
  times_share_ended_ = 0;
  counts_.Clear();
  shortened_.Clear();
  last_rebounds_.Clear();
  turned_at_ = -HUGE_VAL;
  search_.StartStep(model, t, h, state);
  supports_.StartStep(*model.structure, t);
}

StepReport EventStepper::Advance(const Model<double>& model, double t, double h, AtEvent at_event,
                                 State<double>* state) {
  StepReport outcome;
  BeginStep(model, t, h, *state);
  const EdgeGroup at_start = AddEdgesAtStart(model, t, *state, &outcome);
  SetReleased(model, JustAfter(model, t), state);
  const std::vector<Edge> edges = EdgesWithin(model, t, t + h);
  const double end = t + h;
  double now = t;
  Tries tries;
  const auto fail = [&] {
    outcome.status = StepStatus::kUnsolved;
    return outcome;
  };
  bool at_given_time = true;
  bool begins = true;
  int num_motions = 0;
  if (!FollowAfter(model, t, at_start, state, &outcome)) return fail();
  while (end - now > kTimeRounding * h || !at_given_time) {
    const bool at_end = end - now <= kTimeRounding * h;
    if (!SolveInstantOrBehind(model, now, h, std::exchange(begins, false), at_end, state,
                              &outcome)) {
      return fail();
    }
    if (at_end) break;
    if (const EdgeGroup passed = std::exchange(due_, EdgeGroup()); passed.any) {
      if (!PassEdges(model, now, passed, state, &outcome)) return fail();
      continue;
    }
    const EdgeGroup next =
        NextEdges(edges, now, kTimeRounding * h, InstantWidth(*model.structure, now));
    const double goal = next.any ? next.time : end;
    const double until = now + std::ldexp(goal - now, -tries.halvings);
    TurnOntoEdges(model, now, *state, &outcome);
    Segment& segment = BeginSegment(now, until, *state);
    const Tried tried = TryMotion(model, now, h, state, &tries, &outcome, &segment);
    if (tried == Tried::kFailed) return fail();
    if (tried == Tried::kAgain) continue;
    if (Releases(model, segment)) continue;
    limited_ = limited_ || tries.short_step;
    tries.short_step = false;
    tries.held = false;
    tries.unsolved.clear();
    resting_.clear();
    jammed_.clear();
    guess_.located += IsLocated(segment.event) ? 1 : 0;
    outcome.stopped = at_event == AtEvent::kStopAtSecond && guess_.located > 1;
    if (outcome.stopped) break;
    *state = segment.after;
    TakeHeldSpeeds(*model.structure, segment.before.supports, &state->twist);
    state->servo_modes.clear();
    state->supports.clear();
    supports_.Moved(segment.length > kNoMotion * h);
    at_given_time = segment.event == EventKind::kStepEnd;
    tries.halvings = 0;
    if (at_given_time) {
      now = segment.length < until - now ? now + segment.length : until;
      outcome.events += EndAtGivenTime(now < goal, next, &segment);
      if (now < goal && ++num_motions < kMostMotions) continue;
      if (now < goal) {
        outcome.message = "motions do not end: a body is too slow on its support";
        return fail();
      }
      AddFurtherEdges(model, now, next, *state, &outcome);
      if (next.any) SetReleased(model, JustAfter(model, now), state);
      if (next.any && !FollowAfter(model, now, next, state, &outcome)) return fail();
      continue;
    }
    now += segment.length;
    if (next.any && next.time <= now + kTimeRounding * h) due_ = next;
    tries.halved_motions = 0;
    if (!TakeEvent(model, now, h, segment, state, &outcome)) {
      return fail();
    }
  }
  return outcome;
}

}  // namespace tangible
