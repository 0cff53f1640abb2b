// SPDX-License-Identifier: Apache-2.0
//
// What takes the place of impulses, accelerations and motions that are not found: the impulses of a
// very short step (Painlevé), and contacts that are held.
#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// How often a motion is halved that cannot be integrated over the rest of a step.
constexpr int kMostHalvings = 14;
// How many such shortened motions a step may have. Those of a stiff body would not end.
constexpr int kMostShortened = 50;

}  // namespace

bool EventStepper::Tries::Halve() {
  halved_motions += halvings == 0 ? 1 : 0;
  return ++halvings <= kMostHalvings && halved_motions <= kMostShortened;
}

bool EventStepper::SolveByShortStep(const Model<double>& model, double t, double dt,
                                    State<double>* state, StepReport* outcome) {
  Impulses& impulses = BeginImpulses(t, *state);
  impulses.h = kPainleveStep * dt;
  impulses.contacts = touching_.contacts;
  impulses.friction = touching_.friction;
  impulses.restitution.assign(touching_.contacts.size(), CoefficientSource());
  AssembleImpulses(model, &assembly_, &impulses);
  SizeGuess(impulses.problem, &impulses.solution);
  ContactSolverOptions options = SolverOptionsOf(model.structure->settings);
  options.last_resort = !limited_;
  const ContactSolverReport solved = solver_.Solve(impulses.problem, options, &impulses.solution);
  CountSolve(solved, outcome);
  ++outcome->given_up.short_steps;
  ++outcome->events;
  if (!solved.solved) {
    outcome->residual = solved.residual;
    outcome->message = "accelerations and impulses";
    if (solved.worst_contact >= 0) {
      outcome->message +=
          ": " + NameOfContact(*model.structure, impulses.contacts, solved.worst_contact);
    }
    return false;
  }
  TakeRollingLimits(impulses.solution, &impulses.problem);
  solver_.system().MoveFactorsTo(&impulses.system);
  SpreadTwists(*model.structure, impulses.solution.motion, &state->twist);
  impulses.new_twist = state->twist;
  return true;
}

// An impact that is slower than this loses no more than what gravity gives back within a step.
double EventStepper::HeldSpeed(const Model<double>& model) {
  const SimulationSettings& settings = model.structure->settings;
  const double gravity = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  return std::max(settings.restitution_threshold, gravity * settings.dt);
}

// Balls that just fit between two walls push each other nearly along the line in which they lie, by
// rows that depend on each other to rounding: no impulses are found to the tolerance, and many
// exist, because friction holds bodies between faces that are nearly parallel whatever the
// impulses along the normals are. What approaches is held, and what that would press together too:
// a ball that rolls from one facet of a fine curve to the next leaves the one behind. What slides
// faster than this slides on.
bool EventStepper::HoldsSlow(const Model<double>& model, Impulses* impact, State<double>* state,
                             StepReport* outcome) {
  const double slow = HeldSpeed(model);
  const double still = SlowSpeed(model, *state);
  const std::vector<ActiveContact> contacts = impact->contacts;
  const std::vector<CoefficientSource> friction = impact->friction;
  const std::vector<CoefficientSource> restitution = impact->restitution;
  const std::vector<ContactBlock<double>> blocks = impact->problem.contacts;
  const auto speed = [&](const State<double>& at, size_t i) {
    return RelativeSpeed(at, contacts[i].a, blocks[i].normal_a, contacts[i].b, blocks[i].normal_b);
  };
  std::vector<char> holds(contacts.size(), 0);
  bool any = false;
  for (size_t i = 0; i < contacts.size(); ++i) {
    if (speed(*state, i) < -slow) return false;
    holds[i] = speed(*state, i) < -still ? 1 : 0;
    any = any || holds[i] != 0;
  }
  if (!any) holds.assign(contacts.size(), 1);
  State<double> after = *state;
  for (bool more = true; more;) {
    Segment held;
    held.time = impact->time;
    held.middle = inside_;
    held.starts = true;
    for (size_t i = 0; i < contacts.size(); ++i) {
      const double slip = RelativeSpeed(*state, contacts[i].a, blocks[i].tangent_a, contacts[i].b,
                                        blocks[i].tangent_b);
      const bool sticks = blocks[i].has_friction && std::abs(slip) <= slow;
      if (holds[i] == 0 || (contacts[i].IsPureFriction() && !sticks)) continue;
      held.contacts.push_back(contacts[i]);
      held.friction.push_back(friction[i]);
      held.modes.push_back(sticks ? ContactMode::kSticking : ContactMode::kClosed);
    }
    SetUpProjection(held, *state, impact);
    more = false;
    if (!flow_.Project(model, impact)) {
      if (std::all_of(holds.begin(), holds.end(), [](char one) { return one != 0; })) {
        impact->contacts = contacts;
        impact->friction = friction;
        impact->restitution = restitution;
        return false;
      }
      holds.assign(contacts.size(), 1);
      more = true;
      continue;
    }
    after.twist = state->twist;
    SpreadTwists(*model.structure, impact->solution.motion, &after.twist);
    for (size_t i = 0; i < contacts.size(); ++i) {
      if (holds[i] != 0 || !(speed(after, i) < -still)) continue;
      holds[i] = 1;
      more = true;
    }
  }
  ++outcome->given_up.held_contacts;
  state->twist = after.twist;
  impact->new_twist = state->twist;
  return true;
}

// Contacts that do not slide stick and the others slide on.
void EventStepper::HoldModes(const ContactProblem<double>& problem, const std::vector<double>& slip,
                             double slow, std::vector<ContactMode>* modes) {
  for (size_t i = 0; i < modes->size(); ++i) {
    (*modes)[i] = !problem.contacts[i].has_friction ? ContactMode::kClosed
                  : std::abs(slip[i]) <= slow       ? ContactMode::kSticking
                  : slip[i] > 0.0                   ? ContactMode::kSlidingPositive
                                                    : ContactMode::kSlidingNegative;
  }
}

bool EventStepper::HoldsTouching(const Model<double>& model, double t, State<double>* state,
                                 StepReport* outcome) {
  Impulses& impulses = BeginImpulses(t, *state);
  const double slow = SlowSpeed(model, *state);
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    if (touching_.approach[i] > slow || touching_.contacts[i].IsJointFriction() ||
        LacksItsContact(i, impulses.contacts)) {
      continue;
    }
    impulses.contacts.push_back(touching_.contacts[i]);
    impulses.friction.push_back(touching_.friction[i]);
  }
  impulses.restitution.assign(impulses.contacts.size(), CoefficientSource());
  AssembleImpulses(model, &assembly_, &impulses);
  if (!impulses.contacts.empty() && HoldsSlow(model, &impulses, state, outcome)) return true;
  --record_.num_parts;
  return false;
}

// A driven body that turns back just as it reaches what it would crush has turned back.
bool EventStepper::SolveInstantOrBehind(const Model<double>& model, double now, double h,
                                        bool begins, bool at_end, State<double>* state,
                                        StepReport* outcome) {
  const bool turns = !model.structure->paths.empty() && PathJumps(model, now);
  if (!turns) return SolveInstant(model, now, h, begins, at_end, state, outcome);
  const int parts = record_.num_parts;
  const bool starts = guess_.starts;
  const State<double> before = *state;
  if (SolveInstant(model, now, h, begins, at_end, state, outcome)) return true;
  const std::string message = std::exchange(outcome->message, "");
  record_.num_parts = parts;
  guess_.starts = starts;
  *state = before;
  inside_ = JustAfter(model, now);
  FollowPaths(model, now, inside_, state);
  if (SolveInstant(model, now, h, begins, at_end, state, outcome)) return true;
  outcome->message = message;
  return false;
}

}  // namespace tangible
