// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/certify.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "tangible/dynamics/elements/servo.h"
#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/lcp/system/contact_conditioning.h"
#include "tangible/simulation/certificate/approach_inl.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/certificate/duality.h"
#include "tangible/simulation/certificate/feature_ties.h"
#include "tangible/simulation/certificate/segment_share.h"
#include "tangible/simulation/certificate/support_slacks.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_directional.h"
#include "tangible/simulation/derivatives/tolerances.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/servo_bounds.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// With more unknowns than this the rank is determined anew only where modes change.
constexpr size_t kRankEachStep = 150;

// How fast the contacts [first, last) approach before an impact, at most, m/s or rad/s.
double ApproachOf(const StepRecord& impact, size_t first, size_t last) {
  double approach = 0.0;
  for (size_t i = first; i < last; ++i) {
    const ActiveContact& contact = impact.contacts[i];
    const ContactBlock<double>& block = impact.problem.contacts[i];
    approach = std::max(approach, -RelativeSpeed(impact.before, contact.a, block.normal_a,
                                                 contact.b, block.normal_b));
  }
  return approach;
}

}  // namespace

std::string ContactName(const ModelStructure& structure, const ActiveContact& contact) {
  if (contact.is_servo) return NameOfServo(structure, contact);
  if (contact.is_support) return "support of body " + structure.bodies[contact.a].name;
  if (contact.is_rolling) {
    return "rolling friction of " + structure.bodies[contact.a].name + " and " +
           structure.bodies[contact.b].name;
  }
  if (contact.IsJointFriction()) {
    return (contact.is_motor ? "motor of joint " : "friction in joint ") +
           structure.joints[contact.joint].name;
  }
  if (contact.joint >= 0) {
    return std::string(contact.side > 0.0 ? "low" : "high") + " limit of joint " +
           structure.joints[contact.joint].name;
  }
  return "contact of " + structure.bodies[contact.a].name + " and " +
         structure.bodies[contact.b].name;
}

const char* ModeName(ContactMode mode) {
  switch (mode) {
    case ContactMode::kOpen:
      return "open";
    case ContactMode::kSticking:
      return "sticking";
    case ContactMode::kSlidingPositive:
      return "sliding_right";
    case ContactMode::kSlidingNegative:
      return "sliding_left";
    case ContactMode::kClosed:
      return "closed";
  }
  return "";
}

bool RolloutCertifier::Wanted(int number) const {
  if (island_ != nullptr) number = island_->NumberInWhole(number);
  return number >= 0 &&
         std::binary_search(options_.numbers.begin(), options_.numbers.end(), number);
}

void RolloutCertifier::OneSided(const std::string& reason) {
  if (certificate_.one_sided.empty()) {
    certificate_.one_sided = reason;
  }
}

void RolloutCertifier::AddMargin(double margin, const Place& place, const std::string& what,
                                 AtKink at_kink) {
  step_margin_ = std::min(step_margin_, std::max(margin, 0.0));
  if (at_kink != AtKink::kYes && margin < margin_beside_) {
    margin_beside_ = std::max(margin, 0.0);
    beside_where_ = place.Text() + ", " + what;
  }
  if (at_kink != AtKink::kOfFeatures && margin < margin_but_features_) {
    margin_but_features_ = std::max(margin, 0.0);
    where_but_features_ = place.Text() + ", " + what;
  }
  if (margin < certificate_.margin_min) {
    certificate_.margin_min = std::max(margin, 0.0);
    certificate_.margin_where = place.Text() + ", " + what;
  }
}

void RolloutCertifier::AddJump(double margin, const Place& place, const std::string& what) {
  if (margin < jump_margin_) {
    jump_margin_ = margin;
    jump_where_ = place.Text() + ": " + what;
  }
}

void RolloutCertifier::AddContact(const Model<double>& model, const StepRecord& record,
                                  const ContactScales& scales, const Place& place) {
  const ContactMargin margin =
      MarginOfContact(record.problem, record.solution, scales, static_cast<int>(place.contact));
  const bool slides = SlidingSign(place.mode) != 0.0;
  const bool touches = JustTouches(record, place.contact);
  // A scaled margin compares a slack with its own terms, which may all be rounding.
  if (touches && !(margin.value < kDegenerateTolerance)) {
    ++certificate_.degenerate_rows;
  }
  AddMargin(touches ? 0.0 : margin.value, place, slides ? "sliding" : ModeName(place.mode),
            touches || margin.value < kDegenerateTolerance ? AtKink::kYes : AtKink::kNo);
  AddLaw(model, record, place);
  if (place.mode != ContactMode::kOpen) {
    AddCoefficients(record, place);
    AddFlushCorner(model, record.before, *place.active, record.time);
  }
}

void RolloutCertifier::AddControls(const ModelStructure& structure, const Controls& controls,
                                   long step, Stepper* stepper) {
  if (controls.values.rows() == 0) return;
  const auto changes = [&controls](long k) {
    const Eigen::Index last = controls.values.rows() - 1;
    const Eigen::Index before = std::clamp<Eigen::Index>(k - 1, 0, last);
    const Eigen::Index after = std::clamp<Eigen::Index>(k, 0, last);
    return controls.values.row(before) != controls.values.row(after);
  };
  const StepRecord& record = stepper->record();
  const auto add = [&](const Segment& segment, const ActiveContact& contact) {
    const double time = segment.time + segment.length;
    const Place place{&structure, step, time, 0, &contact, ContactMode::kOpen};
    for (const long boundary : {step, step + 1}) {
      const double edge = record.time + static_cast<double>(boundary - step) * record.h;
      const double distance = std::abs(time - edge) / record.h;
      if (distance < kBesideControls && changes(boundary)) {
        AddMargin(distance, place, "an event as controls change");
      }
    }
  };
  stepper->parts().ForEachPart([&](const IslandRecord& island, const EventPart& part) {
    if (part.is_impulses || !part.segment.IsEventLocated()) return;
    add(part.segment, island.InWhole(part.segment.event_contact));
  });
}

// The choice of the constant in the contact law: it causes kinks where the constant is continuous,
// jumps at the conditions of an impact.
void RolloutCertifier::AddLaw(const Model<double>& model, const StepRecord& record,
                              const Place& place) {
  const SimulationSettings& settings = model.structure->settings;
  const size_t i = place.contact;
  const double gap = place.active->gap;
  const LawDistances law = LawDistancesOf(model, record, i);
  if (place.mode != ContactMode::kOpen && law.has_recovery) {
    AddMargin(std::abs(law.recovery.relative()), place, "limit of the recovery speed");
  }
  const double e = record.restitution[i].value;
  const bool at_zero = e == 0.0 && (Wanted(record.restitution[i].numbers[0]) ||
                                    Wanted(record.restitution[i].numbers[1]));
  if (!law.has_restitution || !(e > 0.0 || at_zero)) {
    return;
  }
  const double fast = law.fast.relative();
  const double near = law.near.relative();
  if (at_zero) {
    if (fast > 0.0 && near > 0.0 && gap > 0.0) {
      AddJump(0.0, place, "its restitution is 0, above which an impact has another law");
    }
    return;
  }
  if (gap < 0.0 && fast > 0.0 && near > 0.0) {
    // In penetration the smaller constant holds; the choice is continuous.
    const double other = std::max(gap / record.h, -settings.recovery_speed);
    const double bounce = e * law.approach.before;
    AddMargin(std::abs(bounce - other) / std::max(std::abs(bounce), std::abs(other)), place,
              "restitution against recovery");
    if (bounce >= other) {
      return;
    }
  }
  const bool impact = fast > 0.0 && near > 0.0;
  // An impact disappears if one condition changes; an impact arises if all conditions that do not
  // hold change.
  const double distance =
      impact ? std::min(fast, near) : std::max(std::max(-fast, 0.0), std::max(-near, 0.0));
  const bool by_speed = impact ? fast < near : -fast > -near;
  AddJump(distance, place,
          by_speed ? "approach speed " + Short(-law.approach.before) + " m/s near the threshold " +
                         Short(settings.restitution_threshold) + " m/s"
                   : "free motion ends " + Short(gap + law.reach) +
                         " m from the surface, near the margin " + Short(settings.contact_margin) +
                         " m");
}

void RolloutCertifier::AddCoefficients(const StepRecord& record, const Place& place) {
  const CoefficientSource& friction = record.friction[place.contact];
  const bool wanted = Wanted(friction.numbers[0]) || Wanted(friction.numbers[1]);
  if (wanted && friction.tie && place.mode != ContactMode::kSticking) {
    OneSided("mixed friction is at a kink of the mixing rule, " + place.Text());
  } else if (wanted && friction.value == 0.0) {
    OneSided("friction is 0, " + place.Text());
  }
  const CoefficientSource& restitution = record.restitution[place.contact];
  if (restitution.tie && place.active->law == ContactLaw::kRestitution &&
      (Wanted(restitution.numbers[0]) || Wanted(restitution.numbers[1]))) {
    OneSided("mixed restitution is at a kink of the mixing rule, " + place.Text());
  }
}

void RolloutCertifier::AddLinearSystem(const Model<double>& model, const StepRecord& record,
                                       ContactSystem* system) {
  const std::vector<ContactMode>& modes = record.solution.modes;
  // What rests has the system of the step before.
  if (!last_.Repeats(model, record)) {
    const size_t unknowns = 3 * static_cast<size_t>(system->num_blocks());
    if (unknowns <= kRankEachStep || modes != last_.modes) {
      last_redundant_ = CountRedundantRows(record.problem, modes);
      if (last_redundant_ > 0) {
        AddRedundancy(*model.structure, record.problem, modes, record.friction);
      }
    }
    const SystemQuality quality = MeasureSystem(record.problem, modes, system);
    certificate_.condition = std::max(certificate_.condition, quality.condition);
    certificate_.linear_residual = std::max(certificate_.linear_residual, quality.residual);
  }
  certificate_.redundant_rows += last_redundant_;
}

// Each pair of shapes is examined once; its contacts are adjacent in the list. In an impact these
// are pairs that approach: what else it moves has not just met.
void RolloutCertifier::AddFeatures(const Model<double>& model, const StepRecord& record, long step,
                                   ContactSystem* system) {
  const std::vector<ActiveContact>& contacts = record.contacts;
  const double approach = record.h == 0.0 ? ApproachOf(record, 0, contacts.size()) : 0.0;
  size_t last = 0;
  for (size_t first = 0; first < contacts.size(); first = last) {
    for (last = first + 1;
         last < contacts.size() && contacts[last].IsOfTheSameShapes(contacts[first]);) {
      ++last;
    }
    if (record.h == 0.0 && !(ApproachOf(record, first, last) > kLoaded * approach)) continue;
    const Place place{model.structure.get(),       step, record.time, first, &contacts[first],
                      record.solution.modes[first]};
    const double margin = FeatureChangeMargin(model, record, first, last, system);
    if (record.h > 0.0 && margin < kNearKinkMargin) {
      feature_ties_.push_back({step, contacts[first].a, contacts[first].b});
    }
    AddMargin(margin, place, "where another corner or edge takes over", AtKink::kOfFeatures);
  }
}

void RolloutCertifier::AddSupports(const Model<double>& model, long step,
                                   const StepRecord& record) {
  // What bodies at rest give each other is a share: one beyond the limit, where the friction was
  // found to settle, says nothing of others.
  const auto is_squeezed = [&](int body) {
    for (size_t i = 0; i < record.contacts.size(); ++i) {
      const ActiveContact& contact = record.contacts[i];
      if (contact.IsOfShapes() && record.solution.modes[i] != ContactMode::kOpen &&
          (contact.a == body || contact.b == body) &&
          SupportsHoldBoth(*model.structure, record.before, contact)) {
        return true;
      }
    }
    return false;
  };
  ForEachSupportSlack(model, record, [&](const SupportSlack& slack) {
    if (slack.margin == 0.0 && !slack.slides && is_squeezed(slack.contact.a)) return;
    AddMargin(slack.margin,
              {model.structure.get(), step, record.time, 0, &slack.contact, ContactMode::kOpen},
              slack.slides ? "sliding" : "sticking");
  });
}

// Friction of a support acts from the first step on, whether the body slides or rests.
void RolloutCertifier::AddSupportsWithoutFriction(const Model<double>& model,
                                                  const StepRecord& first) {
  const ModelStructure& s = *model.structure;
  for (const SupportIndex& support : s.supports) {
    const int friction = support.numbers + SupportIndex::kFriction;
    if (model.parameters[friction] != 0.0 || !Wanted(friction)) continue;
    ActiveContact contact;
    contact.a = support.body;
    contact.b = s.world();
    contact.is_support = true;
    const Place place{&s, 0, first.time, 0, &contact, ContactMode::kOpen};
    OneSided("friction is 0, " + place.Text());
  }
}

// The mode of a servo is that of its effort at the step's start.
void RolloutCertifier::AddServos(const Model<double>& model, long step, const StepRecord& record) {
  const ModelStructure& s = *model.structure;
  for (int k = 0; k < static_cast<int>(s.servos.size()); ++k) {
    if (!s.servos[k].has_limit || !IsServoOn(model, k, record.time + 0.5 * record.h)) continue;
    const double effort =
        UnboundedEffort(model, record.before, k, {record.time, record.time, record.h});
    const double limit = model.parameters[s.servos[k].Number(ServoIndex::kLimit)];
    const ActiveContact contact = ContactOfServo(s, k);
    AddMargin(std::abs(limit - std::abs(effort)) / (limit + std::abs(effort)),
              {&s, step, record.time, 0, &contact, ContactMode::kOpen}, "bound of a servo");
  }
}

// By events a servo that stays on its bound, as one that holds a load with all that it has, is at a
// kink: beside it, it has its stiffness on one side and none on the other. One that passes its
// bound is not, as its effort does not jump there.
void RolloutCertifier::AddServosOnBound(const Model<double>& model, long step,
                                        const Segment& segment) {
  const ModelStructure& s = *model.structure;
  if (!(segment.length > kStaysOnBound * s.settings.dt)) return;
  const double end = segment.time + segment.length;
  for (int k = 0; k < static_cast<int>(s.servos.size()); ++k) {
    if (!s.servos[k].has_limit || !IsServoOn(model, k, segment.middle)) continue;
    for (const double sign : {1.0, -1.0}) {
      const auto is_on = [&](const State<double>& state, double time) {
        const BoundReserve left = ReserveOf(model, state, k, sign, time, segment.middle);
        return std::abs(left.value) <= kServoBound * left.terms;
      };
      if (!is_on(segment.before, segment.time) || !is_on(segment.after, end)) continue;
      const ActiveContact contact = ContactOfServo(s, k);
      AddMargin(0.0, {&s, step, segment.time, 0, &contact, ContactMode::kOpen},
                "it stays on its bound");
    }
  }
}

// At the length 0 the direction of a spring turns, and its force jumps by twice that of its rest
// length, at an instant that is no event: what that adds to derivatives is missing.
void RolloutCertifier::AddSprings(const Model<double>& model, double time,
                                  const State<double>& before, const State<double>& after) {
  for (const SpringIndex& spring : model.structure->springs) {
    const double* x = &model.parameters[spring.numbers];
    if (!spring_turns_.empty() || x[SpringIndex::kStiffness] * x[SpringIndex::kRestLength] == 0.0) {
      continue;
    }
    const auto offset = [&](const State<double>& state) {
      const Pose<double> a = state.PoseOf(spring.a), b = state.PoseOf(spring.b);
      return Vector2<double>(a.position + a.rotation * Vector2<double>(x[0], x[1]) - b.position -
                             b.rotation * Vector2<double>(x[2], x[3]));
    };
    const Vector2<double> from = offset(before), to = offset(after), way = to - from;
    const double length = way.norm();
    // As the ends of a straight way, with the nearest point inside or at an end.
    const bool passes = from.dot(way) <= 0.0 && to.dot(way) >= 0.0;
    if (!passes || !(length > 0.0)) continue;
    const double nearest = std::abs(from.x() * way.y() - from.y() * way.x()) / length;
    if (nearest > kNoLength * length) continue;
    spring_turns_ = "spring " + spring.name + " has no length at t = " + Short(time) +
                    " s or soon after, where its force turns round";
  }
}

void RolloutCertifier::AddDiscreteMap(const Model<double>& model, long step,
                                      const StepRecord& record) {
  made_last_.clear();
  if (!discrete_map_) discrete_map_.emplace(model);
  for (const ContactChange& change : discrete_map_->AddStep(model, record)) {
    const std::string text = TextOf(*model.structure, step, record.time, change);
    if (certificate_.discrete_map.empty()) certificate_.discrete_map = text;
    if (change.kind == ContactChange::Kind::kRestitution && certificate_.discrete_impact.empty()) {
      certificate_.discrete_impact = text;
    }
    if (change.kind == ContactChange::Kind::kMade && made_last_.empty()) {
      made_last_ = text + " in the last step";
    }
  }
  if (certificate_.discrete_map.empty()) {
    certificate_.discrete_map = EdgeThatLetsGo(model, step, record);
  }
  if (certificate_.discrete_map.empty() && step == 0 && Directions().cols() > 0) {
    certificate_.discrete_map = SetOffAtStart(model, record);
  }
  held_last_.clear();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    if (record.solution.modes[i] == ContactMode::kSticking) {
      held_last_.push_back(record.contacts[i]);
    }
  }
}

std::string RolloutCertifier::SetOffAtStart(const Model<double>& model,
                                            const StepRecord& record) const {
  const ModelStructure& s = *model.structure;
  constexpr char kSetOff[] = ", its load sets it off from rest";
  LocalJacobianScratch scratch;
  State<double> after = record.before;
  after.twist = record.new_twist;
  const auto slips = [&](const State<double>& state, const ActiveContact& contact) {
    const double slip = SpeedsOf(model, state, contact).slip;
    return std::abs(slip) > Negligible(model, slip);
  };
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (SlidingSign(record.solution.modes[i]) == 0.0) continue;
    if (slips(record.before, contact) || !slips(after, contact)) continue;
    std::vector<JacobianEntry> gradient;
    AddSlipGradient(model, record.before, contact, &scratch, &gradient);
    if (MovesAny(gradient)) return PlaceText(s, 0, record.time, contact) + kSetOff;
  }
  for (size_t k = 0; k < record.before.supports.size(); ++k) {
    const int body = s.supports[k].body;
    const double* before = &record.before.twist[3 * static_cast<size_t>(body)];
    const double* after = &record.new_twist[3 * static_cast<size_t>(body)];
    const auto moves = [](const double* twist) {
      return twist[0] != 0.0 || twist[1] != 0.0 || twist[2] != 0.0;
    };
    if (moves(before) || !moves(after)) continue;
    ActiveContact contact;
    contact.is_support = true;
    contact.a = body;
    contact.b = s.world();
    for (int i = 0; i < 3; ++i) {
      if (MovesAny({{0, s.TwistVariable(body, i), 1.0}})) {
        return PlaceText(s, 0, record.time, contact) + kSetOff;
      }
    }
  }
  return "";
}

std::string RolloutCertifier::EdgeThatLetsGo(const Model<double>& model, long step,
                                             const StepRecord& record) {
  const ModelStructure& s = *model.structure;
  const double near = kSameInstant * s.settings.dt;
  // Where the force has too small a part of the step, friction lets go in the next one.
  std::string edge = std::exchange(held_edge_, "");
  const auto check = [&](const ForceIndex& force, int number, const char* which) {
    if (!Wanted(number)) return;
    const double time = model.parameters[number];
    if (time >= record.time - near && time <= record.time + record.h + near) {
      edge = std::string(which) + " of force " + force.name;
      held_edge_ = edge;
    }
  };
  for (const ForceIndex& force : s.forces) {
    check(force, force.start, "start");
    check(force, force.end, "end");
  }
  for (const PathIndex& index : s.paths) {
    if (!Wanted(index.numbers + kPathDelay)) continue;
    const std::vector<double>& times = index.path->times();
    const double delay = model.parameters[index.numbers + kPathDelay];
    const auto first = std::lower_bound(times.begin(), times.end(), record.time - near - delay);
    for (auto at = first; at != times.end() && *at + delay <= record.time + record.h + near; ++at) {
      if (!index.path->JumpsAt(static_cast<int>(at - times.begin()))) continue;
      edge = "jump of the path of " + s.bodies[index.body].name;
      held_edge_ = edge;
    }
  }
  if (edge.empty()) return "";
  State<double> after = record.before;
  after.twist = record.new_twist;
  const auto starts = [](double before, double then) {
    return std::abs(before) <= kNoSlip * std::abs(then) && then != 0.0;
  };
  bool lets_go = false;
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (!record.problem.contacts[i].has_friction || SlidingSign(record.solution.modes[i]) == 0.0) {
      continue;
    }
    const auto slip = [&](const State<double>& state) {
      return contact.is_rolling ? state.twist[3 * static_cast<size_t>(contact.a) + 2] -
                                      state.twist[3 * static_cast<size_t>(contact.b) + 2]
                                : SpeedsOf(model, state, contact).slip;
    };
    // A driven body has its new speed before the friction at it has let go.
    const bool goes = std::abs(slip(after)) > kNoApproach * LoadAcceleration(record.problem);
    lets_go =
        lets_go || (goes && (starts(slip(record.before), slip(after)) || Has(held_last_, contact)));
  }
  for (const SupportIndex& support : s.supports) {
    const auto largest = [&](const std::vector<double>& twist) {
      const double* of = &twist[3 * static_cast<size_t>(support.body)];
      return std::max({std::abs(of[0]), std::abs(of[1]), std::abs(of[2])});
    };
    lets_go = lets_go || starts(largest(record.before.twist), largest(record.new_twist));
  }
  if (!lets_go) return "";
  held_edge_.clear();
  return "step " + std::to_string(step) + ", t = " + Short(record.time) + " s: " + edge +
         ", as friction lets go";
}

void RolloutCertifier::AddStep(const Model<double>& model, long step, Stepper* stepper) {
  if (!coordinates_) coordinates_.emplace(model);
  step_margin_ = std::numeric_limits<double>::infinity();
  const StepRecord& at = stepper->record();
  if (step == 0) AddSupportsWithoutFriction(model, at);
  coordinates_->LookAtContacts(at.before, at.time, at.contacts);
  coordinates_->LookAtJoints(model, at.before, at.time);
  if (stepper->by_events()) {
    AddEventStep(model, step, stepper);
    return;
  }
  AddDiscreteMap(model, step, at);
  if (!model.structure->springs.empty()) {
    State<double> after = at.before;
    for (size_t i = 0; i < after.pose.size(); ++i) after.pose[i] += at.h * at.new_twist[i];
    AddSprings(model, at.time, at.before, after);
  }
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  const ModelStructure& s = *model.structure;
  landing_.clear();
  const ContactScales scales(record.problem, record.solution);
  AddFacesAcross(model, record.before, record.contacts, record.solution.modes, record.time);
  std::vector<ActiveContact> closed;
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    const Place place{&s, step, record.time, i, &contact, record.solution.modes[i]};
    AddContact(model, record, scales, place);
    if (place.mode == ContactMode::kOpen) {
      continue;
    }
    closed.push_back(contact);
    const bool held = Has(closed_, contact);
    if (!held && contact.law == ContactLaw::kGap && contact.gap > 0.0 &&
        ApproachOf(s, record, i).before < -s.settings.restitution_threshold) {
      landing_ =
          "landing in the last step, whose twist has derivatives of order 1/dt: " + place.Text();
    }
  }
  closed_.swap(closed);
  std::vector<int> degenerate;
  FindDegenerateContacts(record.problem, record.solution, kDegenerateTolerance, &degenerate);
  certificate_.degenerate_rows += static_cast<int>(degenerate.size());
  AddServos(model, step, record);
  AddSupports(model, step, record);
  if (step == 0) touching_at_start_ = record.contacts;
  AddLinearSystem(model, record, &stepper->system());
  AddFeatures(model, record, step, &stepper->system());
  last_.Keep(model, record);
}

Certificate RolloutCertifier::Finish(const Model<double>& model, const RolloutReport& report) {
  AddForceWindows(model);
  AddReleases(model);
  AddPaths(model);
  certificate_.mode_switches = static_cast<int>(report.mode_switches);
  certificate_.events = static_cast<int>(report.events);
  certificate_.bounces_ended = static_cast<int>(report.bounces_ended);
  certificate_.fallbacks = static_cast<int>(report.given_up.total() +
                                            report.SolvedBy(Rung::kInteriorPoint, Rung::kLemke));
  if (jump_margin_ < kNearJumpMargin) {
    certificate_.discontinuous = jump_where_;
  } else {
    certificate_.discontinuous = landing_;
  }
  if (certificate_.discontinuous.empty() && report.halved_motions > 0) {
    certificate_.discontinuous =
        "motions were halved, as they could not be integrated over a step: how often may be chosen "
        "by rounding; dt is too large";
  }
  if (certificate_.discontinuous.empty()) certificate_.discontinuous = report.energy_grown;
  if (certificate_.discontinuous.empty()) certificate_.discontinuous = spring_turns_;
  if (coordinates_) certificate_.coordinates = coordinates_->Message(model);
  if (certificate_.discrete_impact.empty()) certificate_.discrete_impact = made_last_;
  Certificate finished = certificate_;
  if (report.status != StepStatus::kDone) {
    finished.discontinuous = "the run fails: " + report.message;
  }
  SetVerdict(finished);
  return finished;
}

void RolloutCertifier::LeaveOutKinks(Certificate* certificate) const {
  certificate->degenerate_rows = 0;
  certificate->margin_min = margin_beside_;
  certificate->margin_where = beside_where_;
  SetVerdict(*certificate);
}

namespace {

Certificate Certify(ControlledModel<double> model, const State<double>& initial,
                    RolloutCertifier* certifier, RolloutReport* report) {
  Stepper stepper(model.At(0));
  State<double> final;
  *report = Rollout(
      model, initial,
      [&](long k, double, const State<double>&, Stepper* done) {
        if (done != nullptr) {
          certifier->AddStep(model.At(k - 1), k - 1, done);
          if (model.is_controlled()) {
            certifier->AddControls(model.structure(), *model.controls(), k - 1, done);
          }
        }
      },
      &stepper, &final);
  return certifier->Finish(model.At(0), *report);
}

}  // namespace

Certificate CertifyRollout(const ControlledModel<double>& model, const State<double>& initial,
                           const CertifyOptions& options, RolloutReport* report) {
  RolloutReport own;
  RolloutCertifier certifier(options);
  return Certify(model, initial, &certifier, report == nullptr ? &own : report);
}

namespace {

// Indices of the model's numbers that the directions change.
std::vector<int> NumbersOf(const ModelStructure& structure, const RowMatrixXd& directions) {
  std::vector<int> numbers;
  for (int i = 0; i < structure.num_parameters; ++i) {
    if (!directions.row(structure.ParameterVariable(i)).isZero(0.0)) {
      numbers.push_back(i);
    }
  }
  return numbers;
}

// Whether the run has one derivative along each direction, by fixed steps: those along and against
// it, which are exact, and the tangent, in the modes that were found, are the same after each step.
// Then nothing at a kink moves, or whatever moves has the same rates on both sides. What differs
// after one step may be made up for by the next, as of what lands on a step's end or a step later;
// unrolled Jets, which take their modes step by step, do not follow that.
class OneDerivative {
 public:
  OneDerivative(const State<double>& initial, const RowMatrixXd& directions,
                const std::vector<double>& sizes)
      : both_(directions), along_(directions), against_(-directions), largest_(directions.cols()) {
    double place = 0.0;
    for (const double x : initial.pose) place = std::max(place, std::abs(x));
    for (const double v : initial.twist) place = std::max(place, std::abs(v));
    for (Eigen::Index c = 0; c < directions.cols(); ++c) {
      const double size = sizes.empty() ? 1.0 : sizes[static_cast<size_t>(c)];
      largest_[c] = kNoMovement * place / size;
    }
  }

  void AddStep(const Model<double>& model, Stepper* stepper) {
    if (!holds_) return;
    tangent_.Apply(model, stepper, &both_);
    std::string message;
    holds_ = directional_along_.Apply(model, stepper, &along_, &message) &&
             directional_against_.Apply(model, stepper, &against_, &message);
    const Eigen::Index states = model.structure->ParameterVariable(0);
    for (Eigen::Index c = 0; c < both_.cols() && holds_; ++c) {
      const auto both = both_.col(c).head(states);
      largest_[c] = std::max(largest_[c], both.cwiseAbs().maxCoeff());
      const double apart = std::max((along_.col(c).head(states) - both).cwiseAbs().maxCoeff(),
                                    (against_.col(c).head(states) + both).cwiseAbs().maxCoeff());
      holds_ = apart <= kSameSides * largest_[c];
    }
  }
  bool holds() const { return holds_; }

 private:
  RowMatrixXd both_, along_, against_;
  StepTangent tangent_;
  StepDirectional directional_along_, directional_against_;
  VectorX<double> largest_;  ///< of each column so far
  bool holds_ = true;
};

bool HasOneDerivative(const Model<double>& model, const State<double>& initial,
                      const RowMatrixXd& directions, const std::vector<double>& sizes) {
  OneDerivative one(initial, directions, sizes);
  State<double> final;
  Rollout(
      model, initial,
      [&](long, double, const State<double>&, Stepper* stepper) {
        if (stepper != nullptr) one.AddStep(model, stepper);
      },
      &final);
  return one.holds();
}

}  // namespace

Certificate CertifyDerivative(const Model<double>& model, const State<double>& initial,
                              const RowMatrixXd& directions, const std::vector<std::string>& names,
                              const std::vector<double>& sizes,
                              const std::vector<StateRead>& reads) {
  constexpr double kMostExceeded = 1e6;
  RolloutReport report;
  RolloutCertifier certifier({NumbersOf(*model.structure, directions), directions, names, reads});
  Certificate certificate = Certify(model, initial, &certifier, &report);
  if (certificate.degenerate_rows > 0 && report.status == StepStatus::kDone &&
      model.structure->settings.stepping == Stepping::kFixed &&
      HasOneDerivative(model, initial, directions, sizes)) {
    certifier.LeaveOutKinks(&certificate);
  }
  if (certificate.degenerate_rows == 0 && report.status == StepStatus::kDone &&
      model.structure->settings.stepping == Stepping::kFixed) {
    certifier.LeaveOutFeatures(model, initial, &certificate);
  }
  // Residuals of single solves do not show the digits that an ill-conditioned sequence of them
  // loses, nor how successive impacts multiply rounding.
  constexpr double kIllConditioned = 1e8;
  constexpr long kManyEvents = 10;
  if (!HasWideMasses(model) && !(certificate.condition > kIllConditioned) &&
      certificate.redundant_rows == 0 && certificate.events < kManyEvents) {
    return certificate;
  }
  DualityTest test(model, initial, directions);
  // Beside far lighter bodies what an impact drives is large without a contradiction.
  const bool may_measure =
      model.structure->settings.stepping == Stepping::kFixed || !HasWideMasses(model);
  if (certificate.redundant_rows > 0 && certificate.one_sided.empty() && may_measure &&
      !(test.contradiction() < kMostExceeded)) {
    // Then no derivative exists that could be compared.
    certificate.one_sided = kContradictingRows;
    SetVerdict(certificate);
  } else if (report.status == StepStatus::kDone) {
    certificate.linear_residual = std::max(certificate.linear_residual, test.Gap(sizes));
    SetVerdict(certificate);
  }
  return certificate;
}

}  // namespace tangible
