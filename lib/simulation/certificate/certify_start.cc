// SPDX-License-Identifier: Apache-2.0
//
// Certificates of event steps: contacts that touch as the run starts, and the effect of a direction
// on them.
#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/certificate/feature_ties.h"
#include "tangible/simulation/certificate/split_error.h"
#include "tangible/simulation/certificate/start_probe.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/support_bounds.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Whether a contact of two bodies sticks over a segment, if there is one.
bool Sticks(const Segment* segment, const ActiveContact& contact) {
  for (size_t i = 0; segment != nullptr && i < segment->contacts.size(); ++i) {
    if (segment->contacts[i].SameAs(contact)) {
      return contact.IsOfShapes() && segment->modes[i] == ContactMode::kSticking;
    }
  }
  return false;
}

// Whether a direction changes the quantity whose gradient the entries are.
bool Moves(const std::vector<JacobianEntry>& gradient, const RowMatrixXd& directions,
           Eigen::Index direction) {
  double rate = 0.0;
  double terms = 0.0;
  for (const JacobianEntry& entry : gradient) {
    const double term = entry.value * directions(entry.variable, direction);
    rate += term;
    terms += std::abs(term);
  }
  return std::abs(rate) > kUnmoved * terms;
}

// Whether a contact neither opens nor approaches.
bool Rests(const Model<double>& model, const State<double>& state, const ActiveContact& contact) {
  const double speed = SpeedsOf(model, state, contact).normal;
  return std::abs(speed) <= Negligible(model, speed);
}

// Whether the friction of a contact that slides is not that of an impact, which has the friction at
// rest: after a small lift-off the landing brakes more than the load would have meanwhile.
bool BrakesMoreAsItLands(const Model<double>& model, const State<double>& state,
                         const ActiveContact& contact) {
  DecaySource decay;
  if (!MixedDecay(model, contact.a, contact.b, &decay)) return false;
  const double slip = SpeedsOf(model, state, contact).slip;
  const double numbers[3] = {MixedFriction(model, contact.a, contact.b).value, decay.kinetic.value,
                             decay.speed.value};
  return std::abs(slip) > Negligible(model, slip) &&
         std::abs(FrictionDecay(numbers, slip)) > kNoDecay * numbers[0];
}

// The acceleration of bodies by forces as a segment starts, m/s².
double Acceleration(const Model<double>& model, const Segment* segment) {
  double largest = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  if (segment != nullptr && segment->num_stages > 0) {
    const ContactProblem<double>& problem = segment->stages[0].problem;
    for (size_t i = 0; i < problem.load.size(); ++i) {
      if (i % 3 < 2) largest = std::max(largest, std::abs(problem.load[i]) / problem.mass[i]);
    }
  }
  return largest;
}

// The contacts that may touch at a state, and all limits, with their gaps.
void FindNear(const Model<double>& model, const State<double>& state, EventSearch* search,
              std::vector<ActiveContact>* contacts) {
  double reach = 0.0;
  for (int body = 0; body < model.structure->num_bodies(); ++body) {
    reach = std::max(reach, search->lengths().Touch(state, body, body));
  }
  search->FindContacts(model, state, reach, contacts);
  const size_t shapes = contacts->size();
  AppendLimits(model, state, contacts);
  for (size_t k = shapes; k < contacts->size(); ++k) {
    ContactRows<double> rows;
    EvaluateActiveRows(model, state, (*contacts)[k], &rows);
    (*contacts)[k].gap = rows.geometry.gap;
  }
}

// Among contacts that touch, those that may jam, and those that touch a body of one of them,
// because changes of their impulses are transmitted to it.
std::vector<ActiveContact> ThatMayJam(const Model<double>& model, const State<double>& start,
                                      const std::vector<ActiveContact>& touching) {
  const ModelStructure& s = *model.structure;
  std::vector<char> taken(touching.size(), 0);
  std::vector<char> jams(s.bodies.size(), 0);  // bodies
  for (bool more = true; more;) {
    more = false;
    for (size_t i = 0; i < touching.size(); ++i) {
      const ActiveContact& contact = touching[i];
      if (taken[i] == 0 && (jams[contact.a] != 0 || jams[contact.b] != 0 ||
                            MayJam(model, start, touching, contact))) {
        taken[i] = 1;
        more = true;
        for (const int body : {contact.a, contact.b}) {
          jams[body] = s.bodies[body].block >= 0 ? 1 : 0;
        }
      }
    }
  }
  std::vector<ActiveContact> found;
  for (size_t i = 0; i < touching.size(); ++i) {
    if (taken[i] != 0) found.push_back(touching[i]);
  }
  return found;
}

}  // namespace

bool RolloutCertifier::KeepsSide(const Model<double>& model, const ActiveContact& contact,
                                 EventDerivative* derivative, Segment* segment) const {
  // At an instant that an event precedes the contact does not move yet: the next motion tells.
  if (segment->length == 0.0 && !segment->starts) return true;
  if (!segment->starts || Directions().cols() == 0) return false;
  const RowMatrixXd after = derivative->AlongSegment(model, segment, Directions());
  LocalJacobianScratch scratch;
  std::vector<JacobianEntry> slip;
  AddSlipGradient(model, segment->after, contact, &scratch, &slip);
  for (Eigen::Index c = 0; c < after.cols(); ++c) {
    double rate = 0.0;
    double size = 0.0;
    for (const JacobianEntry& entry : slip) {
      rate += entry.value * after(entry.variable, c);
      size += std::abs(entry.value);
    }
    // Joints that transmit nothing leave only rounding.
    if (std::abs(rate) > kUnmoved * size * after.col(c).cwiseAbs().maxCoeff()) return false;
  }
  return true;
}

// Of a run without directions any may be meant.
bool RolloutCertifier::MovesAny(const std::vector<JacobianEntry>& gradient) const {
  if (Directions().cols() == 0) return true;
  for (Eigen::Index c = 0; c < Directions().cols(); ++c) {
    if (Moves(gradient, Directions(), c)) return true;
  }
  return false;
}

bool RolloutCertifier::MovesGap(const Model<double>& model, const State<double>& start,
                                const ActiveContact& contact) const {
  LocalJacobianScratch scratch;
  std::vector<JacobianEntry> gap;
  AddGapGradient(model, start, contact, &scratch, &gap);
  return MovesAny(gap);
}

bool RolloutCertifier::MovesAtStart(const Model<double>& model, const State<double>& start,
                                    const ActiveContact& contact) const {
  LocalJacobianScratch scratch;
  std::vector<JacobianEntry> approach;
  AddApproachGradient(model, start, contact, &scratch, &approach);
  return MovesAny(approach) || MovesGap(model, start, contact);
}

// Whether a contact sticks at its limit as the run starts, slides in the first motion, and either
// some direction changes its slip at the start, which slides at once in either direction; or beside
// the start it begins to slide a little later, and the event splits the motion.
bool RolloutCertifier::LeavesLimitAtStart(const Model<double>& model, const Segment& motion,
                                          size_t contact, EventDerivative* derivative) const {
  const ActiveContact& slides = motion.contacts[contact];
  for (size_t i = 0; start_ != nullptr && i < start_->contacts.size(); ++i) {
    if (start_->modes[i] != ContactMode::kSticking || !start_->contacts[i].SameAs(slides)) {
      continue;
    }
    if (SplitError(model, motion) > kSplitMatters) return true;
    Segment sliding = *start_;
    sliding.modes[i] = motion.modes[contact];
    SegmentFlow flow(model);
    std::string message;
    return flow.Run(model, &sliding, &message) && !KeepsSide(model, slides, derivative, &sliding);
  }
  return false;
}

// Contacts that touch as the run starts: in the impacts of its first instant and in the first
// segment.
void RolloutCertifier::AddStart(const Model<double>& model, const EventRecord& record) {
  std::vector<const ActiveContact*> touching;
  const State<double>* start = nullptr;
  const Segment* first = nullptr;  // of some length
  for (int p = 0; p < record.num_parts; ++p) {
    const EventPart& part = *record.parts[p];
    const std::vector<ActiveContact>& contacts =
        part.is_impulses ? part.impulses.contacts : part.segment.contacts;
    start = start != nullptr   ? start
            : part.is_impulses ? &part.impulses.before
                               : &part.segment.before;
    for (const ActiveContact& contact : contacts) {
      if (!contact.IsPureFriction()) touching.push_back(&contact);
    }
    if (!part.is_impulses && part.segment.length > 0.0) {
      first = &part.segment;
      break;
    }
  }
  const bool splits = first != nullptr && SplitError(model, *first) > kSplitMatters;
  const size_t loaded = touching.size();
  EventSearch search(model);
  std::vector<ActiveContact> unloaded;
  if (start != nullptr) FindNear(model, *start, &search, &unloaded);
  for (const ActiveContact& contact : unloaded) {
    if (contact.gap <= search.TouchTolerance(model, *start, contact) &&
        std::none_of(touching.begin(), touching.begin() + static_cast<std::ptrdiff_t>(loaded),
                     [&](const ActiveContact* other) { return other->SameAs(contact); })) {
      touching.push_back(&contact);
    }
  }
  LocalJacobianScratch scratch;
  for (size_t k = 0; k < touching.size(); ++k) {
    const ActiveContact* contact = touching[k];
    touching_at_start_.push_back(island_ != nullptr ? island_->InWhole(*contact) : *contact);
    AddFlushCorner(model, *start, *contact, 0.0);
    std::vector<JacobianEntry> gap, approach, slip;
    AddGapGradient(model, *start, *contact, &scratch, &gap);
    AddApproachGradient(model, *start, *contact, &scratch, &approach);
    if (Sticks(first, *contact)) {
      AddSlipGradient(model, *start, *contact, &scratch, &slip);
    }
    // A contact in penetration is pushed out only while it does not open by itself. For a contact
    // at rest on the surface both sides have the same derivative, because a later fall is made up
    // for by the landing; not so where no force presses.
    const bool rests = Rests(model, *start, *contact);
    const double meant = kMeantTouches * search.TouchTolerance(model, *start, *contact);
    const bool opens = k >= loaded || (first != nullptr && !Has(first->contacts, *contact));
    const bool pushed = rests && (opens || contact->gap < -meant);
    if (k >= loaded && !rests) {
      continue;
    }
    for (Eigen::Index c = 0; c < Directions().cols(); ++c) {
      // There is an event soon after the start, on one side or on both: a body whose twist is
      // changed lifts off and lands, or slides and stops. The physics does not change by it, but it
      // splits the step for all bodies.
      const bool splits_here = splits && rests && k < loaded;
      const char* what =
          contact->gap > -meant && Moves(gap, Directions(), c) ? " changes its gap"
          : pushed && Moves(approach, Directions(), c) ? " changes the speed at which it opens"
          : splits_here && (Moves(approach, Directions(), c) || Moves(slip, Directions(), c))
              ? " lets an event split the first step"
              : nullptr;
      if (what != nullptr) {
        OneSided(ContactName(*model.structure, *contact) + " touches at the start, " +
                 options_.names[static_cast<size_t>(c)] + what);
      }
    }
  }
  if (start != nullptr) AddHandOversAtStart(model, *start, touching);
  if (first != nullptr) AddSupportsAtStart(model, *first);
  if (start != nullptr && certificate_.one_sided.empty()) {
    ProbeStarts(model, *start, touching, first);
  }
}

// A body at rest on a support, which its load moves at once: set sliding against it, the body first
// has the friction of the other direction.
void RolloutCertifier::AddSupportsAtStart(const Model<double>& model, const Segment& first) {
  const ModelStructure& s = *model.structure;
  for (size_t k = 0; k < first.before.supports.size(); ++k) {
    const SupportState& at = first.before.supports[k];
    const int body = s.supports[k].body;
    const double* twist = &first.before.twist[3 * static_cast<size_t>(body)];
    const bool rests = std::hypot(twist[0], twist[1]) <= Negligible(model, 0.0) &&
                       std::abs(twist[2]) * RadiusOf(model, body) <= Negligible(model, 0.0);
    if (at.holds != SupportState::kNothing || at.slow != SupportState::kBody || !rests) continue;
    for (Eigen::Index c = 0; c < Directions().cols(); ++c) {
      if (Directions().col(c).segment<3>(s.TwistVariable(body, 0)).isZero(0.0)) continue;
      OneSided(ContactName(s, ContactOfSupport(s, static_cast<int>(k))) + " rests at the start, " +
               options_.names[static_cast<size_t>(c)] + " sets it sliding");
    }
  }
}

// A disc that starts exactly at the end of a face, or just beside it: on one side it leaves the
// face later, or not at all. While it moves along, a direction that changes its speed alone does
// not change where it is.
void RolloutCertifier::AddHandOversAtStart(const Model<double>& model, const State<double>& start,
                                           const std::vector<const ActiveContact*>& touching) {
  const ModelStructure& s = *model.structure;
  for (const ActiveContact* contact : touching) {
    const bool goes_along = IsHandedOver(model, start, *contact, kNearKinkMargin * s.settings.dt);
    if (!goes_along && !IsAtEndOfFace(model, start, *contact)) continue;
    for (Eigen::Index c = 0; c < Directions().cols(); ++c) {
      bool moves = false;
      for (const int body : {contact->a, contact->b}) {
        moves = moves || !Directions().col(c).segment<3>(s.PoseVariable(body, 0)).isZero(0.0);
        moves = moves || (!goes_along &&
                          !Directions().col(c).segment<3>(s.TwistVariable(body, 0)).isZero(0.0));
        const BodyIndex& index = s.bodies[body];
        for (int k = 0; k < index.num_shape_numbers; ++k) {
          moves = moves || Directions()(s.ParameterVariable(index.shape_numbers + k), c) != 0.0;
        }
      }
      if (moves) {
        OneSided(ContactName(s, *contact) + " is at the end of a face at the start, " +
                 options_.names[static_cast<size_t>(c)] + " moves it");
      }
    }
  }
}

// Where contacts may jam, runs are compared.
void RolloutCertifier::ProbeStarts(const Model<double>& model, const State<double>& start,
                                   const std::vector<const ActiveContact*>& touching,
                                   const Segment* first) {
  std::vector<ActiveContact> resting;
  for (const ActiveContact* contact : touching) {
    if (contact->IsOfShapes() && !Has(resting, *contact) && Rests(model, start, *contact)) {
      resting.push_back(*contact);
    }
  }
  const std::vector<ActiveContact> may_jam = ThatMayJam(model, start, resting);
  const double acceleration = Acceleration(model, first);
  LocalJacobianScratch scratch;
  for (Eigen::Index c = 0; c < Directions().cols(); ++c) {
    std::vector<ActiveContact> moved;
    for (const ActiveContact& contact : resting) {
      std::vector<JacobianEntry> approach, slip;
      const bool brakes = BrakesMoreAsItLands(model, start, contact);
      if (brakes || Has(may_jam, contact)) {
        AddApproachGradient(model, start, contact, &scratch, &approach);
      }
      if (brakes && Moves(approach, Directions(), c)) {
        OneSided(ContactName(*model.structure, contact) + " slides at the start, and " +
                 options_.names[static_cast<size_t>(c)] +
                 " opens it: an impact has the friction of a body at rest");
      }
      // A contact that does not slide may begin to slide: friction then reverses the law of the
      // contact, or acts in one direction instead of the other, so that the body tips or does not.
      if (const double speed = SpeedsOf(model, start, contact).slip;
          std::abs(speed) <= Negligible(model, speed) &&
          MixedFriction(model, contact.a, contact.b).value > 0.0) {
        AddSlipGradient(model, start, contact, &scratch, &slip);
      }
      if (Moves(approach, Directions(), c) || Moves(slip, Directions(), c)) {
        moved.push_back(contact);
      }
    }
    if (moved.empty()) {
      continue;
    }
    const StartFinding found = ProbeStart(model, start, moved, Directions().col(c), acceleration,
                                          options_.names[static_cast<size_t>(c)]);
    const Place place{model.structure.get(), 0, 0.0, 0, &found.contact, ContactMode::kOpen};
    if (found.kind == StartKind::kJump) {
      AddJump(0.0, place, found.what);
    } else if (found.kind == StartKind::kKink) {
      OneSided(ContactName(*model.structure, found.contact) + " " + found.what);
    }
  }
}

}  // namespace tangible
