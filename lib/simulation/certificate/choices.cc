// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/choices.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/elements/servo.h"
#include "tangible/simulation/certificate/approach_inl.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/certify_grazing.h"
#include "tangible/simulation/certificate/segment_share.h"
#include "tangible/simulation/certificate/support_slacks.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/servo_bounds.h"

namespace tangible {
namespace {

// Of events that follow each other by more than this many others the order is not asked for.
constexpr size_t kRememberedEvents = 64;
// Added to the detail of a key: of friction to the other side.
constexpr int kOtherSide = 1024;

ChoiceKey KeyOf(ChoiceKind kind, long when, int detail, const ActiveContact& contact) {
  ChoiceKey key{kind, when, detail};
  key.a = contact.a;
  key.b = contact.b;
  key.joint = contact.joint;
  key.side = (contact.side > 0.0   ? 1
              : contact.side < 0.0 ? 2
                                   : 0) +
             (contact.is_motor ? 4 : 0) + (contact.is_servo ? 8 : 0) +
             (contact.is_support ? 16 : 0) + (contact.is_rolling ? 32 : 0);
  key.feature = static_cast<int>(contact.feature.kind);
  key.feature_a = contact.feature.FixedA();
  key.feature_b = contact.feature.FixedB();
  key.part_a = contact.feature.part_a;
  key.part_b = contact.feature.part_b;
  return key;
}

ChoiceKind KindOf(ContactSlack::Kind kind) {
  switch (kind) {
    case ContactSlack::Kind::kOpening:
      return ChoiceKind::kOpening;
    case ContactSlack::Kind::kClosing:
      return ChoiceKind::kClosing;
    case ContactSlack::Kind::kFrictionLimit:
      return ChoiceKind::kFrictionLimit;
    case ContactSlack::Kind::kSlidingSpeed:
      return ChoiceKind::kSlidingSpeed;
  }
  return ChoiceKind::kMode;
}

// The speeds of which a speed between two bodies is a difference, m/s.
double SpeedScale(const Model<double>& model, const State<double>& state,
                  const ActiveContact& contact) {
  double scale = model.structure->settings.dt *
                 std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  for (const int body : {contact.a, contact.b}) {
    const double* twist = &state.twist[3 * static_cast<size_t>(body)];
    scale += std::hypot(twist[0], twist[1]) + std::abs(twist[2]) * RadiusOf(model, body);
  }
  return scale;
}

// Whether two contacts of the same bodies are those at the two ends of a face.
bool IsOfFace(const StepRecord& record, size_t i, size_t k) {
  const RowPart<double>& x = record.problem.contacts[i].normal_a;
  const RowPart<double>& y = record.problem.contacts[k].normal_a;
  return record.contacts[i].IsBetweenTheSame(record.contacts[k]) &&
         std::hypot(x[0] - y[0], x[1] - y[1]) <= kTurned;
}

// Whether a contact slides, at hardly any speed, because the other one of a face sticks: which of
// the two is at its limit is not determined, and together they stick.
bool SticksWithFace(const StepRecord& record, size_t i) {
  if (SlidingSign(record.solution.modes[i]) == 0.0) return false;
  for (size_t k = 0; k < record.contacts.size(); ++k) {
    if (record.solution.modes[k] == ContactMode::kSticking && IsOfFace(record, i, k)) return true;
  }
  return false;
}

// The impulses of all contacts of a face that sticks: what each has left of its limit is not
// determined. False for all but the first of them.
bool AddedFriction(const StepRecord& record, size_t i, double* limit, double* tangent) {
  *limit = 0.0;
  *tangent = 0.0;
  for (size_t k = 0; k < record.contacts.size(); ++k) {
    if (record.solution.modes[k] == ContactMode::kOpen || !(k == i || IsOfFace(record, i, k))) {
      continue;
    }
    if (k < i) return false;
    *limit += record.problem.contacts[k].friction * record.solution.normal_impulse[k];
    *tangent += record.solution.tangent_impulse[k];
  }
  return true;
}

bool ShareABody(const ModelStructure& s, const ActiveContact& x, const ActiveContact& y) {
  for (const int body : {x.a, x.b}) {
    if (s.bodies[body].block >= 0 && (body == y.a || body == y.b)) return true;
  }
  return false;
}

const char* WhatChanges(ChoiceKind kind) {
  switch (kind) {
    case ChoiceKind::kMode:
      return "its mode";
    case ChoiceKind::kClosing:
      return "closing";
    case ChoiceKind::kOpening:
      return "opening";
    case ChoiceKind::kFrictionLimit:
      return "friction limit";
    case ChoiceKind::kSlidingSpeed:
      return "end of sliding";
    case ChoiceKind::kThreshold:
      return "threshold of restitution";
    case ChoiceKind::kReach:
      return "whether a free motion reaches the surface";
    case ChoiceKind::kRecovery:
      return "limit of the recovery speed";
    case ChoiceKind::kWindow:
      return "a force's window or the end of a joint at a step's boundary";
    case ChoiceKind::kEvent:
      return "an event that leaves the run";
    case ChoiceKind::kAfterEnd:
      return "an event that enters the run";
    case ChoiceKind::kOrder:
      return "the order of two events";
    case ChoiceKind::kGrazing:
      return "a touch that is missed";
    case ChoiceKind::kMiss:
      return "a touch where bodies passed each other, or a bound that was not reached";
  }
  return "";
}

}  // namespace

std::string NameOf(const ModelStructure& structure, const Choice& choice) {
  char time[32];
  std::snprintf(time, sizeof(time), "%.6g", choice.time);
  const bool of_bodies = choice.contact.a >= 0 || choice.contact.joint >= 0;
  return "t = " + std::string(time) +
         " s: " + (of_bodies ? ContactName(structure, choice.contact) + ", " : "") +
         WhatChanges(choice.key.kind);
}

const Choice* FirstDifference(const ChoiceList& x, const ChoiceList& y) {
  size_t i = 0;
  size_t k = 0;
  const auto skip = [](const ChoiceList& list, size_t* at) {
    while (*at < list.size() && !list[*at].decides) ++*at;
  };
  for (;;) {
    skip(x, &i);
    skip(y, &k);
    if (i == x.size() || k == y.size()) break;
    if (x[i].key != y[k].key) return x[i].key < y[k].key ? &x[i] : &y[k];
    ++i;
    ++k;
  }
  return i < x.size() ? &x[i] : k < y.size() ? &y[k] : nullptr;
}

void ChoiceWatch::AddStep(const Model<double>& model, long step, Stepper* stepper) {
  is_full_ = is_full_ || choices_.size() > kMostChoices;
  if (is_full_) return;
  if (!stepper->by_events()) {
    AddFixed(model, step, stepper);
    return;
  }
  IslandRecords& records = stepper->mutable_parts();
  Model<double> memory;
  for (int k = 0; k < records.num_islands; ++k) {
    IslandRecord& island = *records.islands[k];
    const Model<double>& own = island.ModelOf(model, &memory);
    for (int p = 0; p < island.events.num_parts; ++p) {
      EventPart& part = *island.events.parts[p];
      if (part.is_impulses) {
        if (!part.impulses.holds) AddImpact(own, island, part.impulses);
      } else {
        AddSegment(own, island, step, &part.segment);
      }
    }
    if (records.time >= end_) continue;
    std::vector<Graze> grazes;
    FindGrazes(own, island.events, HUGE_VAL, 0.0, &grazes);
    for (const Graze& graze : grazes) {
      if (!std::isfinite(graze.slack) || graze.time > end_) continue;
      // The slips and limits of motions are choices of their own (AddSegment).
      if (graze.is_slip || !graze.contact.IsOfShapes()) continue;
      const ActiveContact contact = island.InWhole(graze.contact);
      const ChoiceKind kind = graze.touches ? ChoiceKind::kGrazing : ChoiceKind::kMiss;
      const double size = std::max(RadiusOf(own, graze.contact.a), RadiusOf(own, graze.contact.b));
      const long when = graze.touches ? Count(kind, contact) : step;
      Push({KeyOf(kind, when, 0, contact), contact, graze.time, graze.slack, size});
    }
  }
}

void ChoiceWatch::AddFixed(const Model<double>& model, long step, Stepper* stepper) {
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  const ContactScales scales(record.problem, record.solution);
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    const ContactMode mode = record.solution.modes[i];
    ContactSlack slacks[2];
    const int count =
        SlacksOfContact(record.problem, record.solution, scales, static_cast<int>(i), slacks);
    const bool with_face = SticksWithFace(record, i);
    const ContactMode as_face = with_face ? ContactMode::kSticking : mode;
    const int detail = 8 * static_cast<int>(as_face) + static_cast<int>(contact.law);
    if (mode != ContactMode::kOpen) {
      Push({KeyOf(ChoiceKind::kMode, step, detail, contact), contact, record.time, HUGE_VAL, 0.0,
            true});
    }
    for (int k = 0; k < count; ++k) {
      // Friction in a joint has no normal row.
      if (contact.IsPureFriction() && k == 0) continue;
      const ChoiceKind kind =
          with_face && k == 1 ? ChoiceKind::kFrictionLimit : KindOf(slacks[k].kind);
      const auto add = [&](double slack, int side) {
        Push({KeyOf(kind, step, detail + side, contact), contact, record.time, slack,
              slacks[k].scale});
      };
      double limit, tangent;
      if (kind != ChoiceKind::kFrictionLimit) {
        add(slacks[k].value, 0);
      } else if (AddedFriction(record, i, &limit, &tangent)) {
        add(limit - tangent, 0);
        add(limit + tangent, kOtherSide);
      }
    }
    AddLaw(model, step, record, i);
    if (step > 0) AddApproached(model, step, record, i);
  }
  last_contacts_ = record.contacts;
  AddServos(model, step, record);
  ForEachSupportSlack(model, record, [&](const SupportSlack& slack) {
    const int detail = 4 * slack.support + 2 + (slack.point + 2) * 65536;
    Push({KeyOf(ChoiceKind::kMode, step, detail, slack.contact), slack.contact, record.time,
          slack.slack, slack.scale, true});
  });
  if (model.structure->has_releases) AddReleases(model, step, record);
}

void ChoiceWatch::AddReleases(const Model<double>& model, long step, const StepRecord& record) {
  const ModelStructure& s = *model.structure;
  for (size_t j = 0; j < s.joints.size(); ++j) {
    if (s.joints[j].until < 0) continue;
    const double until = model.parameters[s.joints[j].until];
    const bool has_ended = record.before.released[j] != 0;
    // Of the steps without the joint the first one decides.
    if (has_ended && until < record.time - s.settings.dt) continue;
    ActiveContact contact;
    contact.a = s.joints[j].a;
    contact.b = s.joints[j].b;
    contact.joint = static_cast<int>(j);
    const double slack = std::abs(record.time - until);
    Push({KeyOf(ChoiceKind::kWindow, step, has_ended ? 1 : 0, contact), contact, record.time, slack,
          std::abs(record.time) + std::abs(until), has_ended});
  }
}

void ChoiceWatch::AddApproached(const Model<double>& model, long step, const StepRecord& record,
                                size_t i) {
  const ActiveContact& contact = record.contacts[i];
  const bool is_new = std::none_of(last_contacts_.begin(), last_contacts_.end(),
                                   [&](const ActiveContact& last) { return last.SameAs(contact); });
  if (!is_new || contact.IsPureFriction() || !(contact.gap > 0.0)) return;
  const bool rebounds = contact.law == ContactLaw::kRestitution;
  const double slack = contact.gap - (rebounds ? model.structure->settings.contact_margin : 0.0);
  if (!(slack > 0.0)) return;
  Push({KeyOf(ChoiceKind::kReach, step - 1, 0, contact), contact, record.time, slack, contact.gap});
}

void ChoiceWatch::AddServos(const Model<double>& model, long step, const StepRecord& record) {
  for (int k = 0; k < static_cast<int>(model.structure->servos.size()); ++k) {
    const ServoIndex& servo = model.structure->servos[k];
    if (!servo.has_limit || !IsServoOn(model, k, record.time + 0.5 * record.h)) continue;
    const double effort =
        UnboundedEffort(model, record.before, k, {record.time, record.time, record.h});
    const double limit = model.parameters[servo.Number(ServoIndex::kLimit)];
    const int mode = effort > limit ? 1 : effort < -limit ? 2 : 0;
    const ActiveContact contact = ContactOfServo(*model.structure, k);
    Push({KeyOf(ChoiceKind::kMode, step, 4 * k + mode, contact), contact, record.time,
          std::abs(limit - std::abs(effort)), limit + std::abs(effort), true});
  }
}

void ChoiceWatch::AddReserves(const Model<double>& model, const IslandRecord& island, long step,
                              const Segment& segment) {
  const ModelStructure& s = *model.structure;
  const double end = segment.time + segment.length;
  if (end > end_ * (1.0 + kSlackRounding)) return;
  for (int k = 0; k < static_cast<int>(s.servos.size()); ++k) {
    if (!s.servos[k].has_limit || !IsServoOn(model, k, segment.middle)) continue;
    const ActiveContact contact = island.InWhole(ContactOfServo(s, k));
    for (const int side : {0, 1}) {
      const int detail = 2 * k + side;
      const auto [place, is_first] =
          reserves_.try_emplace(KeyOf(ChoiceKind::kMiss, 0, detail, contact));
      Reserve& last = place->second;
      const auto choice_at = [&](long number, const State<double>& state, double time) -> Choice {
        const BoundReserve left =
            ReserveOf(model, state, k, side == 0 ? 1.0 : -1.0, time, segment.middle);
        return {KeyOf(ChoiceKind::kMiss, number, detail, contact), contact, time, left.value,
                left.terms};
      };
      if (is_first) last.choice = choice_at(-1, segment.before, segment.time);
      const Choice now = choice_at(step, segment.after, end);
      const double rounding = kSlackRounding * now.scale;
      // Of what stays the same the first instant is the choice, as it is beside a load at rest.
      if (std::abs(now.slack - last.choice.slack) <= rounding) continue;
      const bool rises = now.slack > last.choice.slack;
      if (rises && last.falls && last.choice.slack > rounding) Push(last.choice);
      last.falls = !rises;
      last.choice = now;
    }
  }
}

void ChoiceWatch::AddLaw(const Model<double>& model, long step, const StepRecord& record,
                         size_t i) {
  const LawDistances law = LawDistancesOf(model, record, i);
  const ActiveContact& contact = record.contacts[i];
  const bool closed = record.solution.modes[i] != ContactMode::kOpen;
  const auto add = [&](ChoiceKind kind, const Distance& distance, int detail = 0) {
    Push({KeyOf(kind, step, detail, contact), contact, record.time, std::abs(distance.value),
          distance.scale});
  };
  if (law.has_recovery && closed) add(ChoiceKind::kRecovery, law.recovery);
  if (!law.has_restitution || !(record.restitution[i].value > 0.0)) return;
  if (contact.gap < 0.0) {
    // In penetration the smaller constant holds, that of the impact or that of the recovery.
    const SimulationSettings& settings = model.structure->settings;
    const double bounce = record.restitution[i].value *
                          std::min(law.approach.before, -settings.restitution_threshold);
    const double other = std::max(contact.gap / record.h, -settings.recovery_speed);
    if (closed && law.fast.value > 0.0 && law.near.value > 0.0) {
      add(ChoiceKind::kRecovery, {bounce - other, std::max(std::abs(bounce), std::abs(other))}, 1);
    }
    if (bounce >= other) return;
  }
  // An impact disappears where one of two conditions fails; one that is not there arises where the
  // only one that fails comes to hold.
  const bool fast = law.fast.value > 0.0;
  const bool near = law.near.value > 0.0;
  if (near) add(ChoiceKind::kThreshold, law.fast);
  if (fast) add(ChoiceKind::kReach, law.near);
}

long ChoiceWatch::Count(ChoiceKind kind, const ActiveContact& contact) {
  return counts_[KeyOf(kind, 0, 0, contact)]++;
}

void ChoiceWatch::AddImpact(const Model<double>& model, const IslandRecord& island,
                            const Impulses& impact) {
  if (impact.time > end_) return;
  const ContactScales scales(impact.problem, impact.solution);
  const double largest = ImpulseScale(impact.solution.normal_impulse);
  const double threshold = model.structure->settings.restitution_threshold;
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    const ActiveContact contact = island.InWhole(impact.contacts[i]);
    const ContactMode mode = impact.solution.modes[i];
    const bool loaded = impact.solution.normal_impulse[i] > kLoaded * largest;
    const long number = Count(ChoiceKind::kMode, contact);
    const int detail = static_cast<int>(mode) + (impact.decompression ? 16 : 0);
    ContactSlack slacks[2];
    const int count =
        SlacksOfContact(impact.problem, impact.solution, scales, static_cast<int>(i), slacks);
    if (loaded) {
      Push({KeyOf(ChoiceKind::kMode, number, detail, contact), contact, impact.time, HUGE_VAL, 0.0,
            true});
    }
    for (int k = 0; k < count && (loaded || mode == ContactMode::kOpen); ++k) {
      Push({KeyOf(KindOf(slacks[k].kind), -1 - number, detail, contact), contact, impact.time,
            slacks[k].value, slacks[k].scale});
    }
    Commit(PhaseOf(contact));
    if (impact.h != 0.0 || impact.decompression || !(impact.restitution[i].value > 0.0)) continue;
    const ContactBlock<double>& block = impact.problem.contacts[i];
    const ActiveContact& own = impact.contacts[i];
    const double before =
        RelativeSpeed(impact.before, own.a, block.normal_a, own.b, block.normal_b);
    if (-before <= kOpeningSpeed * threshold) continue;
    const bool rebounds = -before > threshold;
    Push({KeyOf(ChoiceKind::kThreshold, number, rebounds ? 1 : 0, contact), contact, impact.time,
          std::abs(-before - threshold), std::max(threshold, -before), true});
  }
}

ChoiceWatch::Phase* ChoiceWatch::PhaseOf(const ActiveContact& contact) {
  return &phases_[KeyOf(ChoiceKind::kMode, 0, 0, contact)];
}

void ChoiceWatch::Commit(Phase* phase, ChoiceKind ended) {
  const auto take = [&](ChoiceKind kind, bool from_zero, int side = 0) {
    ChoiceList of_kind;
    for (const Choice& choice : phase->pending) {
      if (choice.key.kind == kind && (choice.key.detail & kOtherSide) == side) {
        of_kind.push_back(choice);
      }
    }
    // Where it grows from 0 and falls to 0 the events at its ends, which move, are the choice.
    size_t first = 0;
    size_t last = of_kind.size();
    if (from_zero) {
      while (first + 1 < last && of_kind[first + 1].slack >= of_kind[first].slack) ++first;
      ++first;
    }
    if (kind == ended) {
      while (last > first + 1 && of_kind[last - 2].slack >= of_kind[last - 1].slack) --last;
      --last;
    }
    for (size_t i = first; i < last && last <= of_kind.size(); ++i) Push(of_kind[i]);
  };
  take(ChoiceKind::kOpening, false);
  take(ChoiceKind::kFrictionLimit, false);
  take(ChoiceKind::kFrictionLimit, false, kOtherSide);
  take(ChoiceKind::kSlidingSpeed, phase->begins_to_slide);
  phase->pending.clear();
  phase->begins_to_slide = false;
}

void ChoiceWatch::AddClosed(const Segment& segment, const ActiveContact& contact, double same) {
  ActiveContact pair = contact;
  pair.feature = {};
  double* last =
      &closed_until_.try_emplace(KeyOf(ChoiceKind::kOpening, 0, 0, pair), -1.0).first->second;
  if (*last < segment.time - same && segment.time <= end_) {
    const long number = Count(ChoiceKind::kOpening, pair);
    Push({KeyOf(ChoiceKind::kMode, number, 512, pair), contact, segment.time, HUGE_VAL, 0.0, true});
  }
  *last = segment.time + segment.length;
}

void ChoiceWatch::AddForces(const Model<double>& model, const IslandRecord& island, long step,
                            const Segment& segment, size_t i,
                            const ContactSolution<double>& share) {
  const ActiveContact contact = island.InWhole(segment.contacts[i]);
  Phase* phase = PhaseOf(contact);
  const ContactMode mode = segment.modes[i];
  const double same = kSameInstant * model.structure->settings.dt;
  AddClosed(segment, contact, same);
  const bool is_new = phase->mode != mode || phase->last_seen < segment.time - same;
  if (is_new) {
    // Another event, or an impact, has ended the phase before: only what an impact ended was held
    // until then, and that has been taken over already.
    phase->pending.clear();
    phase->mode = mode;
    ++phase->number;
    if (SlidingSign(mode) != 0.0 && segment.time <= end_) {
      // The direction of each slip, which an event, an impact or the start has decided.
      const long slips = Count(ChoiceKind::kSlidingSpeed, contact);
      Push({KeyOf(ChoiceKind::kMode, slips, 128 + static_cast<int>(mode), contact), contact,
            segment.time, HUGE_VAL, 0.0, true});
    }
  }
  phase->last_seen = segment.time + segment.length;
  if (segment.time > end_) return;
  const double start = StepTime(model.structure->settings, step);
  const bool at_start = segment.time <= start + same;
  if (!is_new && !at_start) return;
  const long when = at_start ? step : -1 - phase->number;
  const double largest = ImpulseScale(share.normal_impulse);
  const auto add = [&](ChoiceKind kind, double slack, double scale, int side = 0) {
    phase->pending.push_back({KeyOf(kind, when, 64 + side + static_cast<int>(mode), contact),
                              contact, segment.time, slack, scale});
  };
  if (!contact.IsPureFriction()) {
    add(ChoiceKind::kOpening, share.normal_impulse[i], largest);
    if (segment.time == 0.0 && segment.contacts[i].law == ContactLaw::kRecovery) {
      ContactRows<double> rows;
      EvaluateActiveRows(model, segment.before, segment.contacts[i], &rows);
      // Of bodies that begin in penetration the contact is open where they are that far apart.
      Push({KeyOf(ChoiceKind::kReach, step, 0, contact), contact, segment.time,
            std::abs(rows.geometry.gap), std::abs(rows.geometry.gap)});
    }
  }
  if (SlidingSign(mode) != 0.0) {
    const double slip = SpeedsOf(model, segment.before, segment.contacts[i]).slip;
    const double scale = SpeedScale(model, segment.before, segment.contacts[i]);
    // A slip that begins at an event, whose time varies, begins at 0 whatever varies.
    if (is_new && segment.time > 0.0 && std::abs(slip) <= kNoSlip * scale) {
      phase->begins_to_slide = true;
    }
    add(ChoiceKind::kSlidingSpeed, std::abs(slip), scale);
  } else if (mode == ContactMode::kSticking && !segment.SticksWithEarlier(i)) {
    const double limit = segment.friction[i].value;
    const double above = segment.FrictionLeft(i, limit, 1.0, share);
    const double below = segment.FrictionLeft(i, limit, -1.0, share);
    add(ChoiceKind::kFrictionLimit, above, above + below);
    add(ChoiceKind::kFrictionLimit, below, above + below, kOtherSide);
  }
}

namespace {

// Whether a motion ends at an edge, and not at a fraction of its step that supports, or stages that
// do not converge, have shortened it to.
bool EndsAtEdge(const Model<double>& model, const Segment& segment) {
  if (segment.event != EventKind::kEdge) return false;
  const double end = segment.time + segment.length;
  const double near = 2.0 * kSameInstant * model.structure->settings.dt;
  return segment.length == 0.0 || !EdgesWithin(model, end - near, end + near).empty();
}

}  // namespace

void ChoiceWatch::AddSegment(const Model<double>& model, const IslandRecord& island, long step,
                             Segment* segment) {
  if (segment->length > 0.0) {
    AddReserves(model, island, step, *segment);
    const ContactSolution<double> share = ShareAtStart(model, *segment, &inner_impulses_);
    for (size_t i = 0; i < segment->contacts.size(); ++i) {
      AddForces(model, island, step, *segment, i, share);
    }
  }
  if (segment->IsEventLocated() || EndsAtEdge(model, *segment)) {
    EndPhases(island, *segment);
    AddEvent(model, island, *segment);
  }
}

// What an event ends was not held until its end: its slack is 0 there, whatever varies.
void ChoiceWatch::EndPhases(const IslandRecord& island, const Segment& segment) {
  const ActiveContact& of_event = segment.event_contact;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact& own = segment.contacts[i];
    if (!own.IsBetweenTheSame(of_event)) continue;
    Phase* phase = PhaseOf(island.InWhole(own));
    switch (segment.event) {
      case EventKind::kSlipEnds:
        Commit(phase, ChoiceKind::kSlidingSpeed);
        phase->begins_to_slide = true;  // if it turns around
        break;
      case EventKind::kSlipBegins:
        Commit(phase, ChoiceKind::kFrictionLimit);
        phase->begins_to_slide = true;
        break;
      case EventKind::kLiftOff:
        Commit(phase, own.SameAs(of_event) ? ChoiceKind::kOpening : ChoiceKind::kMode);
        break;
      default:
        break;
    }
  }
}

void ChoiceWatch::AddEvent(const Model<double>& model, const IslandRecord& island,
                           const Segment& segment) {
  const bool is_edge = segment.event == EventKind::kEdge;
  const ActiveContact contact = is_edge ? ActiveContact{} : island.InWhole(segment.event_contact);
  const double time = segment.time + segment.length;
  const int detail = static_cast<int>(segment.event);
  Past now{KeyOf(ChoiceKind::kEvent, 0, detail, contact), segment.event_contact, time, is_edge};
  if (is_edge && island.part) now.bodies = island.part->bodies;
  now.key.when = counts_[now.key]++;
  const bool before_end = time <= end_;
  if (!is_edge) {
    Choice choice{now.key, contact, time, std::abs(end_ - time), end_, before_end};
    if (!before_end) choice.key.kind = ChoiceKind::kAfterEnd;
    Push(choice);
  }
  if (before_end) AddOrder(model, island, segment, now);
  now.contact = contact;
  past_.push_back(std::move(now));
  if (past_.size() > kRememberedEvents) past_.erase(past_.begin());
}

// The last event before this one that acts on it: of the same bodies, or of bodies to which joints
// and contacts transmit forces at once; or an edge of a force that acts on its island.
void ChoiceWatch::AddOrder(const Model<double>& model, const IslandRecord& island,
                           const Segment& segment, const Past& now) {
  const ModelStructure& s = *model.structure;
  CoupledBodies coupled;
  coupled.Connect(s, segment.contacts);
  const auto has = [](const Past& edge, const ActiveContact& contact) {
    const auto in = [&](int body) {
      return std::find(edge.bodies.begin(), edge.bodies.end(), body) != edge.bodies.end();
    };
    return edge.bodies.empty() || in(contact.a) || in(contact.b);
  };
  const auto acts = [&](const Past& past) {
    if (past.is_edge) return has(past, island.InWhole(now.contact));
    if (now.is_edge) return has(now, past.contact);
    const ActiveContact other = island.InIsland(past.contact);
    return other.a >= 0 && other.b >= 0 &&
           (ShareABody(s, other, now.contact) ||
            coupled.GroupOf(other) == coupled.GroupOf(now.contact));
  };
  for (auto past = past_.rbegin(); past != past_.rend(); ++past) {
    if (past->is_edge && now.is_edge) return;
    if (!acts(*past)) continue;
    ChoiceKey same = past->key;
    same.when = now.key.when;
    same.detail = now.key.detail;
    if (same == now.key) return;  // another event of this contact
    ChoiceKey key = now.key;
    key.kind = ChoiceKind::kOrder;
    // A contact's events are numbered; the other contact is told by its bodies and its own number.
    key.detail += 16 * static_cast<int>(past->key.detail);
    key.feature += 64 * (past->key.a + 2) + 65536 * (past->key.b + 2);
    key.side += 16 * static_cast<int>(past->key.when);
    Push({key, now.is_edge ? past->contact : island.InWhole(now.contact), now.time,
          now.time - past->time, end_, true});
    return;
  }
}

ChoiceList ChoiceWatch::Finish(const Model<double>& model) {
  for (auto& [key, phase] : phases_) Commit(&phase);
  phases_.clear();
  for (const auto& [key, left] : reserves_) {
    if (left.falls && left.choice.slack > kSlackRounding * left.choice.scale) Push(left.choice);
  }
  const SimulationSettings& settings = model.structure->settings;
  if (settings.stepping == Stepping::kFixed) {
    for (const ForceIndex& force : model.structure->forces) {
      for (const int number : {force.start, force.end}) {
        if (number < 0) continue;
        const double time = model.parameters[number];
        if (!(time > 0.0) || !(time < end_)) continue;
        const double steps = std::floor(time / settings.dt);
        const double into = time - steps * settings.dt;
        ChoiceKey key{ChoiceKind::kWindow, static_cast<long>(steps), number};
        Push({key, {}, time, std::min(into, settings.dt - into), settings.dt, true});
      }
    }
  }
  std::stable_sort(choices_.begin(), choices_.end(), [](const Choice& x, const Choice& y) {
    return x.key != y.key ? x.key < y.key : x.slack < y.slack;
  });
  choices_.erase(std::unique(choices_.begin(), choices_.end(),
                             [](const Choice& x, const Choice& y) { return x.key == y.key; }),
                 choices_.end());
  return std::move(choices_);
}

}  // namespace tangible
