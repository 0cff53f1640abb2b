// SPDX-License-Identifier: Apache-2.0
//
// Certificates of event steps. A mode that ends at an event has margin 0 there by construction. The
// certificate therefore measures how transversally the event is crossed, and how far modes are from
// a change where they start.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/lcp/system/contact_conditioning.h"
#include "tangible/simulation/certificate/certify_grazing.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/certificate/feature_ties.h"
#include "tangible/simulation/certificate/segment_share.h"
#include "tangible/simulation/certificate/split_error.h"
#include "tangible/simulation/certificate/support_slacks.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_directional.h"
#include "tangible/simulation/derivatives/tolerances.h"
#include "tangible/simulation/events/coupled_bodies.h"
#include "tangible/simulation/events/event_counts.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/support_bounds.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Whether a segment ends because two bodies that were apart touch.
bool EndsInMeeting(const Model<double>& model, const Segment& segment) {
  const ActiveContact& contact = segment.event_contact;
  if (segment.event != EventKind::kTouch || !contact.IsOfShapes() ||
      HasPair(segment.contacts, contact)) {
    return false;
  }
  const double speed = SpeedsOf(model, segment.after, contact).normal;
  return speed < -Negligible(model, speed);
}

// Whether a contact begins in penetration, because another feature of a body that is being moved
// out of it becomes the nearest: its gap has not passed through 0, and does not tell when. Just
// before, that feature may be far from the other body.
bool BeginsInPenetration(const Model<double>& model, const Segment& segment) {
  const ActiveContact& contact = segment.event_contact;
  if (segment.event != EventKind::kTouch || !contact.IsOfShapes()) return false;
  ContactRows<double> rows;
  EvaluateContactRows(model, segment.after, contact, &rows);
  const double size = std::max(RadiusOf(model, contact.a), RadiusOf(model, contact.b));
  return std::abs(rows.geometry.gap) > kBegunDepth * size;
}

double SlipOf(const Model<double>& model, const State<double>& state,
              const ActiveContact& contact) {
  return std::abs(SpeedsOf(model, state, contact).slip);
}

// Whether it matters for the speeds after an impact whether it comes before the jump of the speed
// of a body on a path or behind it: not if the jump makes an inelastic impact again, or anew.
bool StrikesBeforeOrBehind(const Model<double>& model, const Segment& segment,
                           const LoadJump& jump) {
  const ActiveContact& contact = segment.event_contact;
  if (contact.IsPureFriction() || (jump.driven != contact.a && jump.driven != contact.b)) {
    return false;
  }
  const double time = segment.time + segment.length;
  const auto approach = [&](double inside) {
    State<double> state = segment.after;
    FollowPaths(model, time, inside, &state);
    return -SpeedsOf(model, state, contact).normal;
  };
  const double before = approach(JustBefore(model, time));
  const double behind = approach(JustAfter(model, time));
  const double apart = before - behind;
  return std::abs(apart) > Negligible(model, before) &&
         (apart > 0.0 || RestitutionOf(model, contact).value > 0.0);
}

// Whether a contact at rest is accelerated in its direction of sliding as a motion starts, by more
// than the rounding of what the loads and friction would give it.
bool StartsToSlide(const Model<double>& model, const Segment& segment, size_t contact) {
  const SolvedNode& start = segment.stages[0];
  const double largest = LoadAcceleration(start.problem);
  const double rate = SlipRate(model, segment.before, segment.time, segment.middle,
                               start.solution.motion, segment.contacts[contact]);
  return segment.length > 0.0 && SlidingSign(segment.modes[contact]) * rate > kNoRate * largest;
}

}  // namespace

void RolloutCertifier::AddQuality(const ModelStructure& s, const ContactProblem<double>& problem,
                                  const std::vector<ContactMode>& modes,
                                  const std::vector<CoefficientSource>& friction,
                                  ContactSystem* system) {
  const int redundant = CountRedundantRows(problem, modes);
  certificate_.redundant_rows += redundant;
  if (redundant > 0) AddRedundancy(s, problem, modes, friction);
  const SystemQuality quality = MeasureSystem(problem, modes, system);
  certificate_.condition = std::max(certificate_.condition, quality.condition);
  certificate_.linear_residual = std::max(certificate_.linear_residual, quality.residual);
}

void RolloutCertifier::AddImpact(const Model<double>& model, long step, Impulses* impact) {
  if (impact->remainder) return;
  const ModelStructure& s = *model.structure;
  const double threshold = s.settings.restitution_threshold;
  // By Poisson's law the compression decides which contacts rebound.
  const bool is_first = impact->h == 0.0 && !impact->decompression;
  const ContactScales scales(impact->problem, impact->solution);
  for (size_t i = 0; i < impact->contacts.size(); ++i) {
    const ActiveContact& contact = impact->contacts[i];
    const Place place{&s, step, impact->time, i, &contact, impact->solution.modes[i]};
    const ContactBlock<double>& block = impact->problem.contacts[i];
    const double before =
        RelativeSpeed(impact->before, contact.a, block.normal_a, contact.b, block.normal_b);
    const ContactMargin margin =
        MarginOfContact(impact->problem, impact->solution, scales, static_cast<int>(i));
    if (!(margin.value < kDegenerateTolerance) || !StaysUnloaded(model, *impact, i)) {
      AddMargin(margin.value, place,
                std::string(impact->decompression ? "decompression, " : "impact, ") +
                    (block.driven ? "driven and " : "") + ModeName(place.mode));
      certificate_.degenerate_rows += margin.value < kDegenerateTolerance ? 1 : 0;
    }
    if (is_first && place.mode != ContactMode::kOpen) {
      AddFlushCorner(model, impact->before, contact, impact->time);
    }
    const CoefficientSource& friction = impact->friction[i];
    if (place.mode != ContactMode::kOpen && friction.value == 0.0 &&
        (Wanted(friction.numbers[0]) || Wanted(friction.numbers[1]))) {
      OneSided("friction is 0, " + place.Text());
    }
    const CoefficientSource& restitution = impact->restitution[i];
    const bool wanted = Wanted(restitution.numbers[0]) || Wanted(restitution.numbers[1]);
    if (is_first && (restitution.value > 0.0 || wanted)) {
      AddJump(std::abs(-before - threshold) / std::max(threshold, std::abs(before)), place,
              "approach speed " + Short(-before) + " m/s near the threshold " + Short(threshold) +
                  " m/s");
      if (wanted && (restitution.value == 0.0 || restitution.tie) && -before > threshold) {
        OneSided(restitution.tie
                     ? "mixed restitution is at a kink of the mixing rule, " + place.Text()
                     : "restitution is 0, " + place.Text());
      }
    }
  }
  if (is_first) {
    AddSimultaneous(model, step, *impact);
    AddEndsOfSlips(model, step, *impact);
    AddUnloaded(model, step, *impact);
    AddFeatures(model, *impact, step, &impact->system);
  }
  AddQuality(s, impact->problem, impact->solution.modes, impact->friction, &impact->system);
}

// Coupled bodies that stop sliding at the same time: the derivative of the time is that of only one
// of them.
void RolloutCertifier::AddOtherSlips(const Model<double>& model, const Segment& segment,
                                     const Place& place) {
  const ActiveContact& ends = segment.event_contact;
  CoupledBodies coupled;
  coupled.Connect(*model.structure, segment.contacts);
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact& other = segment.contacts[i];
    const double slip = SlipOf(model, segment.before, other);
    if (SlidingSign(segment.modes[i]) != 0.0 && !other.IsBetweenTheSame(ends) &&
        coupled.GroupOf(other) == coupled.GroupOf(ends) &&
        SlipOf(model, segment.after, other) <= Negligible(model, slip)) {
      AddMargin(0.0, place, "two contacts stop sliding at the same time");
    }
  }
}

// Keeps the contacts that stop sliding at the end of the segment, whatever event ends it.
void RolloutCertifier::KeepEndsOfSlips(const Model<double>& model, const Segment& segment) {
  const double end = segment.time + segment.length;
  std::erase_if(slips_ended_, [&](const Strike& slip) {
    return end - slip.time > kNearJumpMargin * model.structure->settings.dt;
  });
  const auto keep = [&](const ActiveContact& contact) {
    slips_ended_.push_back({island_ != nullptr ? island_->InWhole(contact) : contact, end});
  };
  if (segment.event == EventKind::kSlipEnds) keep(segment.event_contact);
  for (size_t i = 0; i < segment.contacts.size() && segment.length > 0.0; ++i) {
    const ActiveContact& contact = segment.contacts[i];
    const double slip = SlipOf(model, segment.before, contact);
    if (SlidingSign(segment.modes[i]) != 0.0 &&
        SlipOf(model, segment.after, contact) <= Negligible(model, slip)) {
      keep(contact);
    }
  }
}

void RolloutCertifier::AddFriction(const CoefficientSource& friction, const Place& place) {
  if (!Wanted(friction.numbers[0]) && !Wanted(friction.numbers[1])) return;
  if (friction.tie && place.mode != ContactMode::kSticking) {
    OneSided("mixed friction is at a kink of the mixing rule, " + place.Text());
  } else if (friction.value == 0.0) {
    OneSided("friction is 0, " + place.Text());
  }
}

// An event at the instant at which a load jumps that acts on its bodies: beside it the load jumps
// before the event or behind it. The next motion tells whether that matters.
void RolloutCertifier::AddJumpsOfLoads(const Model<double>& model, const Segment& segment,
                                       const Place& place) {
  const bool matters = segment.event == EventKind::kSlipEnds ||
                       segment.event == EventKind::kTouch ||
                       segment.event == EventKind::kSupportStops;
  if (!matters) return;
  const ModelStructure& s = *model.structure;
  const double near = kBesideControls * s.settings.dt;
  const ActiveContact& event = segment.event_contact;
  for (const LoadJump& jump : LoadJumpsWithin(model, place.time - near, place.time + near)) {
    std::vector<ActiveContact> contacts = segment.contacts;
    contacts.push_back(event);
    CoupledBodies coupled;
    coupled.Connect(s, contacts);
    const int group = coupled.GroupOf(event);
    const auto acts_on = [&](int body) {
      return coupled.GroupOf(body) == group ||
             std::any_of(contacts.begin(), contacts.end(), [&](const ActiveContact& contact) {
               return (contact.a == body || contact.b == body) && coupled.GroupOf(contact) == group;
             });
    };
    if (!std::any_of(jump.bodies.begin(), jump.bodies.end(), acts_on)) continue;
    const double distance = std::abs(jump.time - place.time) / s.settings.dt;
    const std::string what = "as " + jump.what + (jump.is_of_a_joint ? " ends" : " jumps");
    const bool is_touch = segment.event == EventKind::kTouch;
    if (is_touch && (jump.is_of_a_joint || StrikesBeforeOrBehind(model, segment, jump))) {
      AddJump(distance, place, what);
    }
    beside_jumps_.push_back(
        {island_ != nullptr ? island_->InWhole(event) : event, distance, place.step, place.time,
         what, is_touch, is_touch && RestitutionOf(model, event).value > 0.0, jump.is_of_a_joint});
  }
}

// What an event and a jump of the load leave at rest together has met them in either order: a slip
// that has ended and does not begin again, an inelastic impact whose contact stays loaded. All else
// has a derivative for each order.
void RolloutCertifier::AddBesideJumps(const Model<double>& model, const Segment& segment) {
  if (!(segment.length > 0.0)) return;
  const ModelStructure& s = *model.structure;
  const auto rests = [&](const BesideJump& beside, const ActiveContact& contact) {
    if (contact.is_support) {
      for (size_t k = 0; k < segment.before.supports.size(); ++k) {
        if (s.supports[k].body == contact.a) {
          return HoldsCentre(s.supports[k], segment.before.supports[k]);
        }
      }
      return false;
    }
    for (size_t i = 0; i < segment.contacts.size(); ++i) {
      const ActiveContact& other = segment.contacts[i];
      if (!other.SameAs(contact)) continue;
      if (SlidingSign(segment.modes[i]) != 0.0 && !beside.is_touch) return false;
      return other.IsPureFriction() || Has(loaded_, contact);
    }
    return false;
  };
  std::erase_if(beside_jumps_, [&](const BesideJump& beside) {
    const ActiveContact contact =
        island_ != nullptr ? island_->InIsland(beside.contact) : beside.contact;
    if (contact.a < 0 || contact.b < 0) return false;
    // A motion from the event to the jump tells nothing of what comes after it.
    if (!(segment.length > 2.0 * beside.distance * s.settings.dt)) return false;
    if (beside.rebounds || beside.of_joint || !rests(beside, contact)) {
      AddMargin(beside.distance, {&s, beside.step, beside.time, 0, &contact, ContactMode::kOpen},
                beside.what);
    }
    return true;
  });
}

// The event at the segment's end: whether it grazes, and what happens with it at once.
void RolloutCertifier::AddEventOf(const Model<double>& model, long step,
                                  EventDerivative* derivative, Segment* segment) {
  const EventDerivative::Rate rate = derivative->EventRate(model, segment);
  certificate_.linear_residual = std::max(certificate_.linear_residual, rate.residual);
  if (segment->IsEventLocated() && rate.terms > 0.0) {
    const Place place{model.structure.get(),           step,
                      segment->time + segment->length, 0,
                      &segment->event_contact,         ContactMode::kOpen};
    // Nothing depends on the time at which a contact is handed over if its equation has no rate.
    if (!segment->hands_over || segment->HasRate(rate.value, rate.terms)) {
      AddMargin(std::abs(rate.value) / rate.terms, place,
                std::string("grazing: rate of the ") + NameOf(segment->event));
    }
    if (segment->event == EventKind::kSlipEnds) AddOtherSlips(model, *segment, place);
    KeepEndsOfSlips(model, *segment);
    AddJumpsOfLoads(model, *segment, place);
    if (EndsInMeeting(model, *segment) &&
        MeetsACorner(model, segment->after, segment->event_contact)) {
      AddJump(0.0, place, "a corner meets a corner");
    }
    if (BeginsInPenetration(model, *segment)) {
      AddJump(0.0, place, "another feature becomes the nearest in penetration");
    }
  }
}

// Whether a sliding contact slides at zero speed, so that friction stays at its limit, which no
// event has decided. Beside a sticking contact of the same bodies this only determines how they
// share the load. `by_share`: its mode by a share of the forces.
bool RolloutCertifier::SlidesAtLimit(const Model<double>& model, ContactMode by_share,
                                     size_t contact, EventDerivative* derivative,
                                     Segment* segment) const {
  const ActiveContact& slides = segment->contacts[contact];
  if (segment->length > 0.0 && LeavesLimitAtStart(model, *segment, contact, derivative)) {
    return true;
  }
  const bool ends_at_once = segment->length == 0.0 && segment->event == EventKind::kSlipEnds;
  if (by_share == ContactMode::kSticking || ends_at_once) return false;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    if (i != contact && segment->SticksWith(i, contact)) return false;
  }
  if (KeepsSide(model, slides, derivative, segment)) return false;
  const double slip =
      std::max(SlipOf(model, segment->before, slides), SlipOf(model, segment->after, slides));
  // A speed that an event leaves is the rounding of what the loads have done.
  const double rounding =
      kNoApproach * model.structure->settings.dt * LoadAcceleration(segment->stages[0].problem);
  return slip <= Negligible(model, slip) + rounding && !StartsToSlide(model, *segment, contact);
}

// What an impact stops dead, and the loads move on at once: a little slower or faster after the
// impact it would slide on, or back until friction had stopped it.
void RolloutCertifier::AddStoppedDead(const Model<double>& model, long step,
                                      const Segment& segment) {
  if (impact_ == nullptr || !(segment.length > 0.0)) return;
  const ModelStructure& s = *model.structure;
  const auto add = [&](double before, double after, const ActiveContact& contact) {
    const double margin = before > Negligible(model, before) ? after / before : 1.0;
    if (!(margin < kNearKinkMargin)) return;
    AddMargin(margin, {&s, step, segment.time, 0, &contact, ContactMode::kOpen},
              "an impact stops it, and its loads move it on");
  };
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact& contact = segment.contacts[i];
    // The friction of an impact that holds a contact would hold it beside it too.
    const bool held =
        std::any_of(impact_->contacts.begin(), impact_->contacts.end(), [&](const auto& other) {
          return other.SameAs(contact) &&
                 impact_->solution.modes[static_cast<size_t>(&other - impact_->contacts.data())] ==
                     ContactMode::kSticking;
        });
    if (!held && SlidingSign(segment.modes[i]) != 0.0 && segment.friction[i].value > 0.0 &&
        StartsToSlide(model, segment, i)) {
      add(SlipOf(model, impact_->before, contact), SlipOf(model, segment.before, contact), contact);
    }
  }
  for (size_t k = 0; k < segment.before.supports.size(); ++k) {
    const int body = s.supports[k].body;
    if (segment.before.supports[k].slow != SupportState::kBody ||
        segment.before.supports[k].holds != SupportState::kNothing) {
      continue;
    }
    const auto speed = [&](const State<double>& state) {
      return std::hypot(state.twist[3 * body], state.twist[3 * body + 1]);
    };
    add(speed(impact_->before), speed(segment.before), ContactOfSupport(s, static_cast<int>(k)));
  }
}

namespace {

// Forces between bodies that need none are rounding: beside what their supports could hold, and
// beside the loads of bodies, as drags that are equal.
double RoundingOfForces(const Model<double>& model, const ContactProblem<double>& problem) {
  double rounding = 0.0;
  for (size_t i = 0; i < problem.load.size(); ++i) {
    if (i % 3 != 2) rounding = std::max(rounding, kForceTolerance * std::abs(problem.load[i]));
  }
  for (const SupportIndex& support : model.structure->supports) {
    const double* x = &model.parameters[support.numbers];
    rounding =
        std::max(rounding, kForceTolerance * x[SupportIndex::kFriction] * x[SupportIndex::kLoad]);
  }
  return rounding;
}

}  // namespace

void RolloutCertifier::AddSegment(const Model<double>& model, long step,
                                  EventDerivative* derivative, Segment* segment) {
  const ModelStructure& s = *model.structure;
  AddSprings(model, segment->time, segment->before, segment->after);
  AddServosOnBound(model, step, *segment);
  // Of the shares that redundant contacts can have of the forces, one with the fewest at a limit.
  SolvedNode& start = segment->stages[0];
  const ContactSolution<double> share = ShareAtStart(model, *segment, &inner_impulses_);
  loaded_.clear();
  double largest = 0.0;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    if (!segment->contacts[i].IsPureFriction()) {
      largest = std::max(largest, share.normal_impulse[i]);
    }
  }
  const double rounding = RoundingOfForces(model, start.problem);
  // The motion that follows an instant starts with the same forces, and knows which contacts at
  // their limit it releases.
  const bool motion_follows = segment->length == 0.0 && segment->event == EventKind::kStepEnd;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    const ActiveContact& contact = segment->contacts[i];
    const Place place{&s, step, segment->time, i, &contact, segment->modes[i]};
    const double normal = share.normal_impulse[i];
    const CoefficientSource& friction = segment->friction[i];
    const auto add_margin = [&](double margin, const char* what) {
      AddMargin(margin, place, what);
      certificate_.degenerate_rows += margin < kDegenerateTolerance ? 1 : 0;
    };
    if (!contact.IsPureFriction()) {
      if (!motion_follows) {
        add_margin(largest > rounding ? normal / largest : 0.0, "normal force");
      }
      if (SureNormal(s, *segment, i, share) > std::max(kLoaded * largest, rounding)) {
        loaded_.push_back(contact);
      }
    }
    if (contact.IsOfShapes() && !HasPair(closed_, contact) &&
        MeetsACorner(model, segment->before, contact)) {
      AddJump(0.0, place, "a corner meets a corner");
    }
    if (SlidingSign(place.mode) != 0.0 &&
        SlidesAtLimit(model, share.modes[i], i, derivative, segment)) {
      add_margin(0.0, "friction limit");
    }
    if (place.mode == ContactMode::kSticking && !segment->SticksWithEarlier(i) && !motion_follows) {
      const double above = segment->FrictionLeft(i, friction.value, 1.0, share);
      const double below = segment->FrictionLeft(i, friction.value, -1.0, share);
      if (above + below > 0.0) {
        add_margin(2.0 * std::min(above, below) / (above + below), "friction limit");
      }
    }
    AddFriction(friction, place);
  }
  AddStoppedDead(model, step, *segment);
  if (!motion_follows) AddHeldSupports(model, step, *segment);
  if (segment->starts && segment->length == 0.0) {
    start_ = segment;
  } else if (segment->length > 0.0) {
    start_ = nullptr;
  }
  AddSplits(model, step, *segment);
  AddBesideJumps(model, *segment);
  if (!segment->starts && (step > 0 || segment->time > 0.0)) {
    AddClosedAtOnce(model, step, *segment);
  }
  AddTwoLimits(model, step, *segment);
  closed_ = segment->contacts;
  if (Wanted(segment->edge_before) ||
      (segment->edge_before >= 0 && Wanted(segment->event_number))) {
    AddOrder(model, *segment);
  }
  AddLimitsAtRelease(model, step, *segment);
  AddEventOf(model, step, derivative, segment);
  AddQuality(*model.structure, start.problem, segment->modes, segment->friction, &start.system);
}

void RolloutCertifier::AddHeldSupports(const Model<double>& model, long step,
                                       const Segment& segment) {
  ForEachHeldSupport(model, segment, [&](const SupportSlack& slack) {
    // What lets go at once is located as an event.
    const bool goes_at_once = segment.length == 0.0 && segment.event_index == slack.support &&
                              segment.event == EventKind::kSupportLetsGo;
    if (goes_at_once) return;
    AddMargin(slack.margin,
              {model.structure.get(), step, segment.time, 0, &slack.contact, ContactMode::kOpen},
              "sticking");
  });
}

// Edges at one instant whose order matters.
void RolloutCertifier::AddOrder(const Model<double>& model, const Segment& segment) {
  const bool are_paths = IsPathsDelay(*model.structure, segment.edge_before);
  if (are_paths && Directions().rows() > 0 &&
      CoupledPaths(model, Directions(), segment.event_number, segment.edge_before, segment.time)
          .empty()) {
    return;  // they vary alike
  }
  OneSided((are_paths ? "the speeds of two driven bodies jump at "
                      : "windows of two forces open or close at ") +
           Short(segment.time + segment.length) + " s, where their order matters");
}

// An event on the end of a step: beside it, it splits the motion before that end or the one behind
// it. This changes a motion by the integrator's error.
void RolloutCertifier::AddSplits(const Model<double>& model, long step, const Segment& segment) {
  const SimulationSettings& settings = model.structure->settings;
  const auto in_whole = [&](const ActiveContact& contact) {
    return island_ != nullptr ? island_->InWhole(contact) : contact;
  };
  const auto in_island = [&](const ActiveContact& contact) {
    return island_ != nullptr ? island_->InIsland(contact) : contact;
  };
  const bool moves = segment.length > 0.0;
  double error = -1.0;
  const auto add = [&](const Boundary& boundary, const ActiveContact& contact) {
    error = error < 0.0 ? SplitError(model, segment) : error;
    if (!(error > kSplitMatters)) return;
    AddMargin(boundary.distance,
              {model.structure.get(), step, segment.time, 0, &contact, ContactMode::kOpen},
              "an event at a step's end splits either step, which changes the integrator's error");
  };
  std::erase_if(boundaries_, [&](const Boundary& boundary) {
    const ActiveContact contact = in_island(boundary.contact);
    if (!moves || contact.a < 0 || contact.b < 0) return false;
    add(boundary, contact);
    return true;
  });
  if (moves && edge_splits_) {
    error = error < 0.0 ? SplitError(model, segment) : error;
    if (error > kSplitMatters) {
      OneSided("an edge at " + Short(segment.time) +
               " s is on a step's end: beside it, it splits either step, which changes the "
               "integrator's error");
    }
    edge_splits_ = false;
  }
  const bool is_edge = segment.event == EventKind::kEdge && Wanted(segment.event_number);
  if (!segment.IsEventLocated() && !is_edge) return;
  const double end = segment.time + segment.length;
  // Nothing moves before the run's start.
  const double since = step > 0 ? std::abs(end - StepTime(settings, step)) : HUGE_VAL;
  const double distance =
      std::min(since, std::abs(end - StepTime(settings, step + 1))) / settings.dt;
  if (!(distance < kNearKinkMargin)) return;
  if (is_edge) {
    edge_splits_ = true;
    return;
  }
  boundaries_.push_back({in_whole(segment.event_contact), distance});
  if (moves) add(boundaries_.back(), segment.event_contact);
}

// A joint that ends as it reaches its limit, or just before: beside it the limit is met.
void RolloutCertifier::AddLimitsAtRelease(const Model<double>& model, long step,
                                          const Segment& segment) {
  if (segment.event != EventKind::kEdge || segment.event_number < 0) return;
  const ModelStructure& s = *model.structure;
  std::vector<ActiveContact> limits;
  AppendLimits(model, segment.before, &limits);
  for (const ActiveContact& limit : limits) {
    if (s.joints[limit.joint].until != segment.event_number) continue;
    AddTouchBehind(model, step, segment, limit, "as the joint ends");
  }
}

// What would touch just behind a motion, though the run or a joint ends.
void RolloutCertifier::AddTouchBehind(const Model<double>& model, long step, const Segment& last,
                                      const ActiveContact& contact, const std::string& what) {
  const ModelStructure& s = *model.structure;
  const bool is_closed = Has(last.contacts, contact);
  const ContactSpeeds speeds = SpeedsOf(model, last.after, contact);
  const double speed = speeds.normal;
  // What slides along a face that it touches approaches it by rounding.
  if (is_closed || !(speed < -Negligible(model, std::hypot(speed, speeds.slip)))) return;
  ContactRows<double> rows;
  EvaluateActiveRows(model, last.after, contact, &rows);
  const double margin = std::max(rows.geometry.gap, 0.0) / (-speed * s.settings.dt);
  if (margin < kNearJumpMargin) {
    AddJump(margin, {&s, step, last.time + last.length, 0, &contact, ContactMode::kOpen}, what);
  }
}

// Touches at the end of the run's last motion, or just behind it.
void RolloutCertifier::AddTouchesAtEnd(const Model<double>& model, long step, const Segment& last) {
  const ModelStructure& s = *model.structure;
  EventSearch search(model);
  double reach = 0.0;
  for (int body = 0; body < s.num_bodies(); ++body) {
    const double* twist = &last.after.twist[3 * static_cast<size_t>(body)];
    const double speed =
        std::hypot(twist[0], twist[1]) + std::abs(twist[2]) * search.lengths().radius(body);
    reach = std::max(reach, search.lengths().Touch(last.after, body, body) +
                                2.0 * kNearJumpMargin * s.settings.dt * speed);
  }
  std::vector<ActiveContact> near;
  search.FindContacts(model, last.after, reach, &near);
  AppendLimits(model, last.after, &near);
  for (const ActiveContact& contact : near) {
    if (!MovesRead(s, step + 1, contact)) continue;
    AddTouchBehind(model, step, last, contact, AsRead(s, step + 1, "it touches"));
  }
}

// A disc's contact that is handed over from a face to its end, or back, at the end of the run's
// last motion, or just before or behind it: from there on the disc turns about a corner, or no
// longer.
void RolloutCertifier::AddHandOversAtEnd(const Model<double>& model, long step,
                                         const Segment& last) {
  const ModelStructure& s = *model.structure;
  for (const ActiveContact& contact : last.contacts) {
    if (MovesRead(s, step + 1, contact) &&
        IsHandedOver(model, last.after, contact, kNearKinkMargin * s.settings.dt)) {
      AddMargin(0.0, {&s, step, last.time + last.length, 0, &contact, ContactMode::kOpen},
                AsRead(s, step + 1, "another corner or edge takes over"));
    }
  }
}

// Events at the run's last instant, or at one at which a state is read, or just before or behind
// it: beside it they have happened or not, which is another derivative of twists, or other twists.
// Positions have the same on both sides, as do all where forces change gradually (a start of
// sliding, a lift-off).
void RolloutCertifier::AddEnd(const Model<double>& model, long step, const EventRecord& record) {
  const ModelStructure& s = *model.structure;
  const double dt = s.settings.dt;
  const double end = StepTime(s.settings, step + 1);
  const Segment* last = nullptr;
  const auto add = [&](double time, const ActiveContact& contact) {
    const double margin = std::abs(end - time) / dt;
    if (margin < kNearKinkMargin && MovesRead(s, step + 1, contact)) {
      AddMargin(margin, {&s, step, time, 0, &contact, ContactMode::kOpen},
                AsRead(s, step + 1, "it stops sliding"));
    }
  };
  for (int p = 0; p < record.num_parts; ++p) {
    if (record.parts[p]->is_impulses) continue;
    const Segment& segment = record.parts[p]->segment;
    const double time = segment.time + segment.length;
    last = segment.length > 0.0 ? &segment : last;
    if (segment.event == EventKind::kSlipEnds || segment.event == EventKind::kSupportStops) {
      add(time, segment.event_contact);
    }
    if (segment.event == EventKind::kTouch && end - time < kNearJumpMargin * dt) {
      const double speed = SpeedsOf(model, segment.after, segment.event_contact).normal;
      if (speed < -Negligible(model, speed) && MovesRead(s, step + 1, segment.event_contact)) {
        AddJump((end - time) / dt, {&s, step, time, 0, &segment.event_contact, ContactMode::kOpen},
                AsRead(s, step + 1, "it touches"));
      }
    }
  }
  if (last == nullptr) return;
  for (size_t i = 0; i < last->contacts.size(); ++i) {
    if (MovesRead(s, step + 1, last->contacts[i])) {
      AddFlushCorner(model, last->after, last->contacts[i], end);
    }
    const double before = SlipOf(model, last->before, last->contacts[i]);
    const double after = SlipOf(model, last->after, last->contacts[i]);
    if (SlidingSign(last->modes[i]) != 0.0 && after < before) {
      add(last->time + last->length * (before / (before - after)), last->contacts[i]);
    }
  }
  for (size_t k = 0; k < last->before.supports.size(); ++k) {
    const SupportState& at = last->before.supports[k];
    if (at.slow == SupportState::kNothing) continue;
    const int support = static_cast<int>(k);
    const double before = SupportProgress(model, last->before, support, at);
    const double after = SupportProgress(model, last->after, support, at);
    if (after < before) {
      add(last->time + last->length * (before / (before - after)), ContactOfSupport(s, support));
    }
  }
  AddTouchesAtEnd(model, step, *last);
  AddHandOversAtEnd(model, step, *last);
}

// Contacts and impacts of earlier steps, as the island's: its bodies may have been in several.
void RolloutCertifier::EnterIsland(const ModelStructure& whole, const IslandRecord& island) {
  const auto of_island = [&](const std::vector<ActiveContact>& all,
                             std::vector<ActiveContact>* own) {
    own->clear();
    for (const ActiveContact& contact : all) {
      own->push_back(island.InIsland(contact));
      if (own->back().a < 0 || own->back().b < 0) own->pop_back();
    }
  };
  island_ = &island;
  own_directions_.resize(0, 0);
  if (options_.directions.cols() > 0) {
    GatherRows(whole, *island.part, options_.directions, &own_directions_);
  }
  of_island(all_closed_, &closed_);
  of_island(all_loaded_, &loaded_);
  struck_at_.clear();
  for (const int body : island.part->bodies) {
    struck_at_.push_back(all_struck_at_[body]);
  }
}

void RolloutCertifier::LeaveIsland(const IslandRecord& island) {
  island_ = nullptr;
  for (size_t k = 0; k < struck_at_.size(); ++k) {
    all_struck_at_[island.part->bodies[k]] = struck_at_[k];
  }
  for (ActiveContact& contact : closed_) {
    contact = island.InWhole(contact);
  }
  for (ActiveContact& contact : loaded_) {
    contact = island.InWhole(contact);
  }
}

void RolloutCertifier::AddEventStep(const Model<double>& model, long step, Stepper* stepper) {
  IslandRecords& records = stepper->mutable_parts();
  EventDerivative& derivative = stepper->event_derivative();
  struck_at_.resize(model.structure->bodies.size(), -std::numeric_limits<double>::infinity());
  if (records.IsWhole()) {
    AddIsland(model, step, &derivative, records.islands[0].get());
    return;
  }
  all_closed_ = closed_;
  all_loaded_ = loaded_;
  all_struck_at_ = struck_at_;
  std::vector<ActiveContact> closed, loaded;
  Model<double> memory;
  for (int k = 0; k < records.num_islands; ++k) {
    IslandRecord& island = *records.islands[k];
    EnterIsland(*model.structure, island);
    AddIsland(island.ModelOf(model, &memory), step, &derivative, &island);
    LeaveIsland(island);
    closed.insert(closed.end(), closed_.begin(), closed_.end());
    loaded.insert(loaded.end(), loaded_.begin(), loaded_.end());
  }
  closed_.swap(closed);
  loaded_.swap(loaded);
  struck_at_.swap(all_struck_at_);
}

void RolloutCertifier::AddIsland(const Model<double>& model, long step, EventDerivative* derivative,
                                 IslandRecord* island) {
  EventRecord& record = island->events;
  start_ = nullptr;
  impact_ = nullptr;
  edge_splits_ = false;
  if (step == 0 && Directions().cols() > 0) {
    AddStart(model, record);
  }
  const Segment* last = nullptr;  // ended by the last event of the pair with the most events
  EventCounts located;
  int most = 0;  // events of one pair
  for (int p = 0; p < record.num_parts; ++p) {
    EventPart& part = *record.parts[p];
    if (part.is_impulses) {
      if (!part.impulses.holds) {
        AddImpact(model, step, &part.impulses);
        impact_ = &part.impulses;
      }
      continue;
    }
    AddSegment(model, step, derivative, &part.segment);
    AddFacesAcross(model, part.segment.before, part.segment.contacts, part.segment.modes,
                   part.segment.time);
    // An impact has the friction of rest, which a corner that is passed without one has not.
    for (size_t i = 0; model.structure->friction_decays && i < part.segment.contacts.size(); ++i) {
      if (SlidingSign(part.segment.modes[i]) == 0.0) continue;
      AddFlushCorner(model, part.segment.before, part.segment.contacts[i], part.segment.time);
    }
    if (part.segment.length > 0.0) impact_ = nullptr;
    missed_ = std::min(missed_ + MissedBy(part.segment), kMostMissed);
    if (part.segment.IsEventLocated()) {
      const int count = located.Add(part.segment.event_contact);
      last = count > most ? &part.segment : last;
      most = std::max(most, count);
    }
  }
  if (IsRead(*model.structure, step + 1)) AddEnd(model, step, record);
  // Infinitely many impacts in a finite time (Zeno): rounding decides how many of them are
  // computed.
  if (2 * most > model.structure->settings.max_events_per_step) {
    const Place place{model.structure.get(),     step,
                      last->time + last->length, 0,
                      &last->event_contact,      ContactMode::kOpen};
    AddMargin(0.0, place, "one of " + std::to_string(most) + " events in a step");
  }
  std::vector<Graze> grazes;
  FindGrazes(model, record, kNearKinkMargin, missed_, &grazes);
  for (const Graze& graze : grazes) {
    const Place place{model.structure.get(), step, graze.time, 0, &graze.contact,
                      ContactMode::kOpen};
    AddMargin(graze.margin, place,
              graze.is_slip   ? (graze.touches ? "grazing end of sliding" : "grazing, slides on")
              : graze.touches ? "grazing touch"
                              : "grazing, no touch");
  }
}

}  // namespace tangible
