// SPDX-License-Identifier: Apache-2.0
//
// Segments of zero length. They move nothing, but derivatives need them at instants that are given
// by the ends of a step and not found by a search:
//
//   a touch at the start of a step   the search of the step before ended on it. Its time still
//                                    depends on the state: it is an event (kTouch) like others
//   an event at the end of a step    the next segment starts at a given time, not at the event
//   an edge at the start of a step   the motion up to it has the forces from before
//                                    (event_edges.h)
//   the start of a run               a change of the initial twist that breaks a rolling contact or
//                                    a joint acts as the impulse that restores it, at once and not
//                                    after the first segment; one that lifts a contact or makes it
//                                    land acts in the same way, with friction
// A box that rocks from corner to corner comes to rest after infinitely many impacts in finite
// time. Settle ends that.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/flush_corners.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Slow impacts count as a rattle after max_events_per_step divided by this.
constexpr int kRattling = 4;

// An impact in a crowd has contacts of more than this many pairs that have had events in the step.
constexpr int kCrowdPairs = 2;

// Whether contact i of an impact belongs to a body without joints that touches only fixed bodies on
// parallel faces, and whose friction is far from reversing the contact law,
//
//   n M⁻¹ n > 1.1 μ |n M⁻¹ t|
//
// Held with friction such a body can neither wedge nor jam.
bool SlidesFreely(const ModelStructure& structure, const Impulses& impact, size_t i) {
  constexpr double kNear = 1.1;
  const ContactBlock<double>& block = impact.problem.contacts[i];
  if ((block.a >= 0) == (block.b >= 0)) {
    return false;
  }
  const int moving = std::max(block.a, block.b);
  const RowPart<double>& normal = block.a >= 0 ? block.normal_a : block.normal_b;
  const RowPart<double>& tangent = block.a >= 0 ? block.tangent_a : block.tangent_b;
  double mixed = 0.0;
  double straight = 0.0;
  for (int k = 0; k < 3; ++k) {
    mixed += normal[k] * tangent[k] / impact.problem.mass[3 * static_cast<size_t>(moving) + k];
    straight += normal[k] * normal[k] / impact.problem.mass[3 * static_cast<size_t>(moving) + k];
  }
  const bool is_jointed =
      std::any_of(structure.joints.begin(), structure.joints.end(), [&](const JointIndex& joint) {
        return structure.bodies[joint.a].block == moving ||
               structure.bodies[joint.b].block == moving;
      });
  return !is_jointed && straight > kNear * block.friction * std::abs(mixed) &&
         std::all_of(impact.problem.contacts.begin(), impact.problem.contacts.end(),
                     [&](const ContactBlock<double>& other) {
                       if (other.a != moving && other.b != moving) return true;
                       const RowPart<double>& n =
                           other.a == moving ? other.normal_a : other.normal_b;
                       return (other.a >= 0) != (other.b >= 0) &&
                              std::abs(n[0] * tangent[0] + n[1] * tangent[1]) <= kFreeSlide;
                     });
}

// The largest acceleration that loads alone give a body, of points m/s² and at the distance of a
// radius of gyration rad/s², for each component: what friction cancels leaves their rounding.
std::vector<double> FreeAccelerations(const ContactProblem<double>& problem) {
  const double fastest = LoadAcceleration(problem);
  const auto arm = [&](size_t k) {
    return std::sqrt(problem.mass[3 * k + 2] / problem.mass[3 * k]);
  };
  std::vector<double> of_components;
  for (size_t i = 0; i < problem.load.size(); ++i) {
    of_components.push_back(i % 3 == 2 ? fastest / arm(i / 3) : fastest);
  }
  return of_components;
}

// Whether the forces of an instant that follows the record are those behind an edge at it: the step
// begins there, or the last motion has ended at an edge and not at an event of its own.
bool FollowsEdges(const EventRecord& record) {
  for (int p = record.num_parts - 1; p >= 0; --p) {
    const EventPart& part = *record.parts[p];
    if (part.is_impulses) continue;
    if (part.segment.event == EventKind::kEdge) return true;
    if (part.segment.length > 0.0) return false;
  }
  return true;
}

}  // namespace

bool EventStepper::AddInstant(const Model<double>& model, double t, EventKind kind,
                              const ActiveContact* contact, State<double>* state,
                              StepReport* outcome) {
  const int parts = record_.num_parts;
  // An edge at the end of the step comes after it, and one at a touch that has ended a motion.
  const bool is_after_edges = guess_.starts || (kind == EventKind::kTouch && FollowsEdges(record_));
  EventPart* part = record_.Add();
  part->is_impulses = false;
  Segment& segment = part->segment;
  segment.time = t;
  segment.length = 0.0;
  segment.starts = guess_.starts;
  // A window is closed from its end on, not at it.
  const bool has_edge = !model.structure->paths.empty() || EdgesAt(model, t).any;
  const double after = due_.follows ? inside_ : has_edge ? JustAfter(model, t) : t;
  segment.middle = is_after_edges ? after : JustBefore(model, t);
  segment.before = *state;
  segment.event_number = -1;
  segment.at_once = false;
  segment.release.clear();
  segment.further_edges.clear();
  segment.edge_before = -1;
  if (!ChooseModes(model, *state, outcome, &segment)) {
    record_.num_parts = parts;
    outcome->message.clear();
    return true;  // no conclusion without accelerations
  }
  // What has just come to rest on its support has accelerations only once it has stopped.
  if (supports_.HasToStop(model, segment)) {
    return StopSupports(model, segment, parts, state, outcome) &&
           AddInstant(model, t, kind, contact, state, outcome);
  }
  segment.event = kind;
  segment.event_index = -1;
  if (contact != nullptr) {
    segment.event_contact = *contact;
    segment.hands_over = segment.passes = false;
  }
  if (!flow_.Run(model, &segment, &outcome->message)) {
    return false;
  }
  *state = segment.after;
  state->supports.clear();
  return true;
}

EdgeGroup EventStepper::LeftOf(const Model<double>& model, const EdgeGroup& passed,
                               const State<double>& state) {
  const ModelStructure& s = *model.structure;
  EdgeGroup rest = passed.Rest();
  if (!rest.any) return rest;
  FindTouching(model, state);
  CoupledBodies coupled;
  coupled.Connect(s, touching_.contacts);
  std::vector<WindowEdge> paths = rest.paths;
  paths.insert(paths.begin(), {passed.window, rest.window});
  std::vector<int> driver(s.bodies.size(), -1);  // of a group of bodies
  for (const WindowEdge& edge : paths) {
    const int body = s.paths[edge.path].body;
    const auto drives = [&](int a, int b) {
      const int group = a == body ? coupled.GroupOf(b) : b == body ? coupled.GroupOf(a) : -1;
      if (group < 0) return false;
      if (driver[group] >= 0 && driver[group] != edge.number) return true;
      driver[group] = edge.number;
      return false;
    };
    const auto meets = [&](const auto& all) {
      return std::any_of(all.begin(), all.end(),
                         [&](const auto& one) { return drives(one.a, one.b); });
    };
    if (!meets(touching_.contacts) && !meets(s.joints)) continue;
    for (int p = record_.num_parts - 1; p >= 0; --p) {
      Segment& segment = record_.parts[p]->segment;
      if (record_.parts[p]->is_impulses) continue;
      if (segment.event == EventKind::kEdge) {
        segment.edge_before =
            edge.number != segment.event_number ? edge.number : rest.window.number;
      }
      break;
    }
    return EdgeGroup();
  }
  return rest;
}

bool EventStepper::FollowAfter(const Model<double>& model, double now, const EdgeGroup& passed,
                               State<double>* state, StepReport* outcome) {
  const ModelStructure& s = *model.structure;
  if (s.paths.empty()) return true;
  due_ = LeftOf(model, passed, *state);
  inside_ = due_.any ? BehindPath(s, now, due_.window.path - 1) : JustAfter(model, now);
  FollowPaths(model, now, inside_, state);
  if (guess_.starts || !JumpPullsJoint(model, now)) return true;
  // Joints follow a jump by the impulse that restores them; contacts that it makes approach have an
  // impact after it.
  if (!ProjectOntoJoints(model, now, state)) {
    outcome->message = "twists of joints whose body's path jumps";
    return false;
  }
  ++outcome->events;
  return true;
}

bool EventStepper::ProjectOntoJoints(const Model<double>& model, double now, State<double>* state) {
  Segment joints;
  joints.time = now;
  joints.middle = inside_;
  EventPart* part = record_.Add();
  part->is_impulses = true;
  SetUpProjection(joints, *state, &part->impulses);
  if (!flow_.Project(model, &part->impulses)) return false;
  SpreadTwists(*model.structure, part->impulses.solution.motion, &state->twist);
  part->impulses.new_twist = state->twist;
  return true;
}

// Friction in a joint holds what does not turn, and a support what stands on it; whether a joint
// turns or a body stands is told by twists that the joints allow.
bool EventStepper::TurnJoints(const Model<double>& model, double now, State<double>* state,
                              StepReport* outcome) {
  FindTouching(model, *state);
  const double slow = SlowSpeed(model, *state);
  const State<double> given = *state;
  const auto rests = [&](const State<double>& at, const ActiveContact& contact) {
    return contact.IsJointFriction() && std::abs(SpeedsOf(model, at, contact).slip) <= slow;
  };
  const auto any = [&](const auto& is_one) {
    return std::any_of(touching_.contacts.begin(), touching_.contacts.end(), is_one);
  };
  const auto stands = [&](const State<double>& at, const SupportIndex& support) {
    const double* const twist = &at.twist[3 * static_cast<size_t>(support.body)];
    return std::max({std::abs(twist[0]), std::abs(twist[1]), std::abs(twist[2])}) <= slow;
  };
  const auto any_support = [&](const auto& is_one) {
    const std::vector<SupportIndex>& supports = model.structure->supports;
    return !model.structure->joints.empty() &&
           std::any_of(supports.begin(), supports.end(), is_one);
  };
  if (!any([&](const ActiveContact& contact) { return rests(given, contact); }) &&
      !any_support([&](const SupportIndex& support) { return stands(given, support); })) {
    return true;
  }
  const int parts = record_.num_parts;
  if (!ProjectOntoJoints(model, now, state)) {
    outcome->message = "twists of joints as the run starts";
    return false;
  }
  const bool turn = any([&](const ActiveContact& contact) {
    return rests(given, contact) && !rests(*state, contact);
  });
  const bool starts = any_support([&](const SupportIndex& support) {
    return stands(given, support) && !stands(*state, support);
  });
  if (turn || starts) {
    FindTouching(model, *state);
  } else {
    record_.num_parts = parts;
    *state = given;
  }
  return true;
}

Segment* EventStepper::AddEdge(const Model<double>& model, double t, double middle,
                               std::vector<WindowEdge> to_come, const State<double>& given,
                               StepReport* outcome) {
  const EventGuess guess = guess_;
  const int parts = record_.num_parts;
  if (model.structure->has_releases) {
    before_edge_ = given;
    SetReleased(model, middle, &before_edge_);
  }
  const State<double>& state = model.structure->has_releases ? before_edge_ : given;
  Segment& segment = BeginSegment(t, t, state);
  segment.middle = middle;
  segment.further_edges = std::move(to_come);
  FindTouching(model, state);
  // The motion up to here did not have contacts that only now approach.
  const double slow = SlowSpeed(model, state);
  for (double& approach : touching_.approach) {
    if (approach < -slow) approach = HUGE_VAL;
  }
  std::string message;
  const bool good = ChooseModes(model, state, outcome, &segment) &&
                    flow_.RunUncorrected(model, &segment, &message);
  outcome->message.clear();
  guess_ = guess;
  if (!good) {
    // No conclusion without accelerations.
    record_.num_parts = parts;
    return nullptr;
  }
  segment.event = EventKind::kEdge;
  segment.event_index = -1;
  return &segment;
}

EdgeGroup EventStepper::AddEdgesAtStart(const Model<double>& model, double t,
                                        const State<double>& state, StepReport* outcome) {
  if (guess_.starts) return {};  // there is no motion before
  EdgeGroup edges = EdgesAt(model, t);
  AddEdgesHere(model, t, edges, state, outcome);
  return edges;
}

bool EventStepper::PassEdges(const Model<double>& model, double t, const EdgeGroup& edges,
                             State<double>* state, StepReport* outcome) {
  AddEdgesHere(model, t, edges, *state, outcome);
  ++outcome->events;
  SetReleased(model, JustAfter(model, t), state);
  return FollowAfter(model, t, edges, state, outcome);
}

void EventStepper::AddEdgesHere(const Model<double>& model, double t, const EdgeGroup& edges,
                                const State<double>& state, StepReport* outcome) {
  if (!edges.any) return;
  const double middle = edges.follows ? inside_ : JustBefore(model, std::min(edges.time, t));
  Segment* segment = AddEdge(model, t, middle, {}, state, outcome);
  if (segment == nullptr) return;
  segment->event_number = edges.window.number;
  AddFurtherEdges(model, t, edges, state, outcome);
}

void EventStepper::AddFurtherEdges(const Model<double>& model, double t, const EdgeGroup& edges,
                                   const State<double>& state, StepReport* outcome) {
  const double after =
      std::nextafter(t + 2.0 * kShortestPart * model.structure->settings.dt, HUGE_VAL);
  const auto accelerations = [&](std::vector<WindowEdge> to_come) {
    const Segment* segment = AddEdge(model, t, after, std::move(to_come), state, outcome);
    if (segment == nullptr) return std::vector<double>();
    --record_.num_parts;
    return segment->stages[0].solution.motion;
  };
  WindowEdge last = edges.window;
  const int first = record_.num_parts;
  for (auto next = edges.further.begin(); next != edges.further.end(); ++next) {
    const std::vector<WindowEdge> rest(next + 1, edges.further.end());
    const auto with = [&](std::vector<WindowEdge> few) {
      few.insert(few.end(), rest.begin(), rest.end());
      return few;
    };
    // Where a contact changes its mode between the edges the motion depends on their order.
    std::vector<double> none, other, both;
    if (last.number >= 0) {
      none = accelerations(with({last, *next}));
      other = accelerations(with({last}));
      both = accelerations(rest);
    }
    Segment* segment = AddEdge(model, t, after, with({*next}), state, outcome);
    if (segment == nullptr) return;
    segment->event_number = next->number;
    const int before = std::exchange(last, *next).number;
    if (before < 0) continue;
    if (none.empty() || other.empty() || both.empty()) return;
    const std::vector<double>& one = segment->stages[0].solution.motion;
    const std::vector<double> free = FreeAccelerations(segment->stages[0].problem);
    for (size_t i = 0; i < one.size(); ++i) {
      const double size = std::max(
          {std::abs(none[i]), std::abs(one[i]), std::abs(other[i]), std::abs(both[i]), free[i]});
      if (std::abs(none[i] - one[i] - other[i] + both[i]) > kNoRate * size) {
        segment->edge_before = before;
      }
    }
  }
  HoldBehindEdges(model, t, after, first, state, outcome);
}

void EventStepper::HoldBehindEdges(const Model<double>& model, double t, double after, int first,
                                   const State<double>& state, StepReport* outcome) {
  if (record_.num_parts == first || AddEdge(model, t, after, {}, state, outcome) == nullptr) return;
  EventPart* part = record_.parts[--record_.num_parts].get();
  const Segment& behind = part->segment;
  const auto holds = [](const Segment& one, const ActiveContact& contact, ContactMode mode) {
    for (size_t i = 0; i < one.contacts.size(); ++i) {
      if (one.contacts[i].SameAs(contact)) return one.modes[i] == mode;
    }
    return false;
  };
  bool lets_go = false;
  for (int p = first; p < record_.num_parts; ++p) {
    const Segment& between = record_.parts[p]->segment;
    lets_go = lets_go || between.before.supports != behind.before.supports;
    for (size_t i = 0; i < behind.contacts.size(); ++i) {
      const bool slides = SlidingSign(behind.modes[i]) != 0.0;
      lets_go = lets_go || (!slides && !holds(between, behind.contacts[i], behind.modes[i]));
    }
  }
  if (!lets_go) return;
  part->is_impulses = true;
  SetUpProjection(behind, behind.before, &part->impulses);
  part->impulses.new_twist = state.twist;
  part->impulses.holds = true;
  if (flow_.Project(model, &part->impulses)) ++record_.num_parts;
}

// Behind a flush corner whose points are parameters the twists are those along the edge ahead,
// which by the points have other derivatives than before.
void EventStepper::TurnOntoEdges(const Model<double>& model, double t, const State<double>& state,
                                 StepReport* outcome) {
  if (t == turned_at_ ||
      std::none_of(touching_.contacts.begin(), touching_.contacts.end(), [&](const auto& contact) {
        return IsOverFlushCorner(model, state, contact) &&
               std::abs(SpeedAlongFace(model, state, contact)) > SlowSpeed(model, state);
      })) {
    return;
  }
  turned_at_ = t;
  if (AddEdge(model, t, t, {}, state, outcome) == nullptr) return;
  EventPart* part = record_.parts[--record_.num_parts].get();
  part->is_impulses = true;
  part->segment.starts = true;  // what slides has friction
  SetUpProjection(part->segment, part->segment.before, &part->impulses);
  part->impulses.new_twist = state.twist;
  part->impulses.holds = true;
  if (flow_.Project(model, &part->impulses)) ++record_.num_parts;
}

bool EventStepper::Rattles(const Model<double>& model, const ActiveContact& contact) const {
  return counts_.Of(contact) > model.structure->settings.max_events_per_step / kRattling;
}

double EventStepper::ReturnSpeed(const Model<double>& model, const State<double>& state,
                                 const ActiveContact& contact) const {
  const ModelStructure& s = *model.structure;
  double acceleration =
      std::max(std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]),
               search_.load_speed() / s.settings.dt);
  for (const SupportIndex& support : s.supports) {
    if (support.body != contact.a && support.body != contact.b) continue;
    const double* x = &model.parameters[support.numbers];
    const double friction = x[SupportIndex::kFriction] * x[SupportIndex::kLoad];
    acceleration = std::max(acceleration, friction / model.parameters[s.bodies[support.body].mass]);
  }
  const double size = search_.lengths().Size(contact.a, contact.b);
  if (contact.joint >= 0 && size > 0.0 && model.structure->joints[contact.joint].is_angular) {
    acceleration /= size;  // rad/s²
  }
  return std::sqrt(2.0 * acceleration * search_.TouchTolerance(model, state, contact));
}

int EventStepper::NumPairsWithEvents(const Impulses& impact) const {
  int pairs = 0;
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    const ActiveContact& contact = impact.contacts[i];
    // The contacts of a pair follow each other.
    const ActiveContact* last = i > 0 ? &impact.contacts[i - 1] : nullptr;
    const bool is_same = last != nullptr && last->a == contact.a && last->b == contact.b &&
                         last->joint == contact.joint;
    pairs += !is_same && counts_.Of(contact) > 0 ? 1 : 0;
  }
  return pairs;
}

double EventStepper::SizeOfGap(const Model<double>& model, const ActiveContact& contact) const {
  return contact.joint >= 0 && model.structure->joints[contact.joint].is_angular
             ? 1.0
             : search_.lengths().Size(contact.a, contact.b);
}

// A new part of the record: an instant's impulses, without contacts so far.
Impulses& EventStepper::BeginImpulses(double t, const State<double>& state) {
  EventPart* part = record_.Add();
  part->is_impulses = true;
  Impulses& impulses = part->impulses;
  impulses.time = t;
  impulses.inside = inside_;
  impulses.h = 0.0;
  impulses.decompression = impulses.remainder = impulses.holds = false;
  impulses.before = state;
  impulses.contacts.clear();
  impulses.friction.clear();
  impulses.restitution.clear();
  return impulses;
}

// The impact of the contacts of a group that touch and do not leave, as a new part of the record.
Impulses* EventStepper::ListImpact(const Model<double>& model, double t, double slow, int group,
                                   const State<double>& state, StepReport* outcome) {
  const SimulationSettings& settings = model.structure->settings;
  Impulses& impact = BeginImpulses(t, state);
  rebounds_.clear();
  bool rattles = false;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    rattles = rattles || (impacts_.Of(i) == group && Rattles(model, touching_.contacts[i]));
  }
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    // In a rattle contacts that leave slowly are held with the others, because they would return at
    // once.
    const double leaves =
        rattles ? std::max(slow, ReturnSpeed(model, state, touching_.contacts[i])) : slow;
    // Friction in a joint is a force, which does nothing at an instant.
    if (touching_.approach[i] > leaves || impacts_.Of(i) != group ||
        touching_.contacts[i].IsJointFriction() || LacksItsContact(i, impact.contacts)) {
      continue;
    }
    ActiveContact contact = touching_.contacts[i];
    const double speed = -touching_.approach[i];
    const double restitution = touching_.restitution[i].value;
    bool rebounds =
        restitution > 0.0 && !IsInelastic(model, contact) && speed > settings.restitution_threshold;
    if (rebounds && last_rebounds_.End(contact, t, speed, restitution,
                                       kReboundHeight * SizeOfGap(model, contact), settings.dt)) {
      rebounds = false;
      ++outcome->bounces_ended;
    }
    if (rebounds && speed > 0.0) last_rebounds_.Add(contact, t, speed, restitution);
    // Poisson's law compresses all contacts inelastically first.
    contact.law = rebounds && settings.impact_law == ImpactLaw::kNewton ? ContactLaw::kRestitution
                                                                        : ContactLaw::kInelastic;
    rebounds_.push_back(rebounds);
    impact.contacts.push_back(contact);
    impact.friction.push_back(touching_.friction[i]);
    impact.restitution.push_back(touching_.restitution[i]);
  }
  return &impact;
}

void CountSolve(const ContactSolverReport& solved, StepReport* outcome) {
  outcome->factorisations += solved.factorisations;
  outcome->iterations += solved.iterations;
  outcome->solver.Add(solved.fallbacks);
  outcome->residual = std::max(outcome->residual, solved.solved ? solved.residual : 0.0);
  outcome->rung = std::max(outcome->rung, solved.rung);
}

std::string NameOfContact(const ModelStructure& structure,
                          const std::vector<ActiveContact>& contacts, int index) {
  if (index < 0) {
    return "joints";
  }
  const ActiveContact& contact = contacts[index];
  return contact.is_servo     ? NameOfServo(structure, contact)
         : contact.is_rolling ? "rolling friction of " + structure.bodies[contact.a].name +
                                    " and " + structure.bodies[contact.b].name
         : contact.is_motor          ? "motor of joint " + structure.joints[contact.joint].name
         : contact.IsJointFriction() ? "friction in joint " + structure.joints[contact.joint].name
         : contact.joint >= 0        ? "limit of joint " + structure.joints[contact.joint].name
                                     : "contact of " + structure.bodies[contact.a].name + " and " +
                                    structure.bodies[contact.b].name;
}

std::string WhatIsUnsolved(const ModelStructure& structure, const Impulses& impulses,
                           const ContactSolverReport& solved) {
  if (solved.worst_contact >= 0) {
    return NameOfContact(structure, impulses.contacts, solved.worst_contact);
  }
  const std::vector<double>& v = impulses.solution.motion;
  const int joint = MostViolatedJoint(impulses.problem, v, v, kNamedJoint);
  return joint < 0 ? "momentum" : NameOfContradicted(structure, joint);
}

double EventStepper::SlowSpeed(const Model<double>& model, const State<double>& state) const {
  double slow = search_.SpeedTolerance(model, state);
  for (const ActiveContact& contact : touching_.contacts) {
    // Nearly dependent rows leave a remainder of the speeds that should vanish.
    if (Rattles(model, contact)) {
      slow = std::max(slow, kRattle * ReturnSpeed(model, state, contact));
    }
  }
  return slow;
}

namespace {

// Whether a closed contact of the same moving bodies carries along nearly the same row what a
// contact that leaves has carried, as where a ball rolls from one facet of a fine curve to the
// next, or from one of two static bodies to the other: gravity does not bring it back.
bool IsCarried(const Impulses& impact, size_t leaves) {
  const ContactProblem<double>& problem = impact.problem;
  const auto row_of = [&](const ContactBlock<double>& x, int block) {
    return block < 0 ? nullptr : block == x.a ? &x.normal_a : block == x.b ? &x.normal_b : nullptr;
  };
  const auto product = [&](size_t i, size_t k) {
    const ContactBlock<double>& x = problem.contacts[i];
    double sum = 0.0;
    for (const int block : {x.a, x.b}) {
      const RowPart<double>* const own = row_of(x, block);
      const RowPart<double>* const other = row_of(problem.contacts[k], block);
      for (int j = 0; own != nullptr && other != nullptr && j < 3; ++j) {
        sum += (*own)[j] * (*other)[j] / problem.mass[3 * block + j];
      }
    }
    return sum;
  };
  for (size_t k = 0; k < impact.contacts.size(); ++k) {
    if (k == leaves || impact.contacts[k].IsPureFriction() ||
        impact.solution.modes[k] == ContactMode::kOpen) {
      continue;
    }
    const double own = product(leaves, leaves), other = product(k, k);
    if (product(leaves, k) >= (1.0 - kCarried) * std::sqrt(own * other)) return true;
  }
  return false;
}

}  // namespace

// After an impact: where a contact that had been at rest leaves so slowly that gravity would bring
// it back before it has left the touching tolerance (or, after max_events_per_step, more slowly
// than the restitution threshold), it stays closed: all touching contacts there are held, along
// their tangents too where they slide no faster. The same is done after a slow impact that only
// sets a contact sliding, which opens another contact that returns, where this has repeated many
// times. In a crowd, where most impacts come from such contacts of others, it is done with all that
// leave and slide more slowly than the restitution threshold and would be back within a step.
bool EventStepper::Settle(const Model<double>& model, const Impulses& impact, State<double>* state,
                          StepReport* outcome) {
  const SimulationSettings& settings = model.structure->settings;
  const double slow = search_.SpeedTolerance(model, *state);
  Segment held;
  held.time = impact.time;
  held.middle = inside_;
  held.starts = true;  // contacts held while sliding have friction
  const bool is_crowd = NumPairsWithEvents(impact) > kCrowdPairs;
  const double within_step =
      0.5 * settings.dt * std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  const double of_crowd = is_crowd ? std::min(settings.restitution_threshold, within_step) : 0.0;
  bool any = false;
  bool all_slow = true;     // no contact approached faster than it would return
  bool any_slides = false;  // although it should stick
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    const ActiveContact& contact = impact.contacts[i];
    if (contact.is_rolling && (held.contacts.empty() || !held.contacts.back().RollsBy(contact))) {
      continue;
    }
    const ContactBlock<double>& block = impact.problem.contacts[i];
    const auto speed = [&](const State<double>& at) {
      return RelativeSpeed(at, contact.a, block.normal_a, contact.b, block.normal_b);
    };
    ContactMode mode = impact.solution.modes[i];
    // A decompression elsewhere may have opened what its compression had closed.
    const bool opened = !rebounds_[i] && speed(*state) > slow;
    const double returns =
        std::max({ReturnSpeed(model, *state, contact), of_crowd,
                  IsInelastic(model, contact) ? settings.restitution_threshold : 0.0});
    all_slow = all_slow && speed(impact.before) >= -returns;
    if (mode == ContactMode::kOpen || opened) {
      if (speed(*state) > returns || (!Rattles(model, contact) && IsCarried(impact, i))) {
        continue;
      }
      any = any || (speed(*state) > slow && speed(impact.before) >= -slow);
      mode = ContactMode::kClosed;
    } else if (rebounds_[i]) {
      continue;
    }
    // A contact that slides no faster than this is made to stick: while it slides it may push
    // another contact open again.
    const double slip =
        RelativeSpeed(*state, contact.a, block.tangent_a, contact.b, block.tangent_b);
    if (block.has_friction && std::abs(slip) <= returns) {
      any_slides = any_slides || std::abs(slip) > slow;
      mode = ContactMode::kSticking;
    } else if (block.has_friction) {
      mode = !SlidesFreely(*model.structure, impact, i) ? ContactMode::kClosed
             : slip > 0.0                               ? ContactMode::kSlidingPositive
                                                        : ContactMode::kSlidingNegative;
    }
    held.contacts.push_back(contact);
    held.friction.push_back(impact.friction[i]);
    held.modes.push_back(mode);
  }
  const bool rattles = std::any_of(impact.contacts.begin(), impact.contacts.end(),
                                   [&](const ActiveContact& c) { return Rattles(model, c); });
  if (!any && !((is_crowd || (rattles && all_slow)) && any_slides)) {
    return true;
  }
  ++outcome->given_up.held_contacts;
  EventPart* part = record_.Add();
  part->is_impulses = true;
  SetUpProjection(held, *state, &part->impulses);
  if (!flow_.Project(model, &part->impulses)) {
    outcome->message = "twists of contacts that come to rest";
    return false;
  }
  SpreadTwists(*model.structure, part->impulses.solution.motion, &state->twist);
  part->impulses.new_twist = state->twist;
  return true;
}

bool EventStepper::LocateTouch(const Model<double>& model, double t, double slow, int group,
                               State<double>* state, StepReport* outcome) {
  if (record_.num_parts > 0) {
    const EventPart& last = *record_.parts[record_.num_parts - 1];
    const EventKind event = last.segment.event;
    if (last.is_impulses ? !impacts_.any_struck()
                         : (event == EventKind::kTouch || event == EventKind::kReturn ||
                            event == EventKind::kAtOnce) &&
                               impacts_.Of(last.segment.event_contact) == group) {
      return true;
    }
  }
  const auto was_closed = [&](const ActiveContact& contact) {
    for (size_t i = 0; i < guess_.contacts.size(); ++i) {
      if (guess_.contacts[i].SameAs(contact)) return guess_.modes[i] != ContactMode::kOpen;
    }
    return false;
  };
  const ActiveContact* touch = nullptr;
  for (size_t i = 0; i < touching_.contacts.size() && touch == nullptr; ++i) {
    // In penetration the depth does not matter: a change of the gap does not change a time.
    const ActiveContact& candidate = touching_.contacts[i];
    const bool on_surface = candidate.gap >= -search_.TouchTolerance(model, *state, candidate);
    if (touching_.approach[i] < -slow && on_surface && !was_closed(candidate) &&
        impacts_.Of(i) == group) {
      touch = &touching_.contacts[i];
    }
  }
  if (touch == nullptr) {
    return true;
  }
  const ActiveContact contact = *touch;
  // The contact that touches acts only by its impact: the motion up to here had only the contacts
  // that were closed before.
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    if (touching_.approach[i] < -slow) touching_.approach[i] = HUGE_VAL;
  }
  const bool good = AddInstant(model, t, EventKind::kTouch, &contact, state, outcome);
  FindTouching(model, *state);
  return good;
}

}  // namespace tangible
