// SPDX-License-Identifier: Apache-2.0
//
// The contacts that touch at an instant, with their speeds.
#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/contacts_ahead.h"
#include "tangible/dynamics/elements/seam_contacts.h"
#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/flush_corners.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

void EventStepper::AddTouching(const Model<double>& model, const State<double>& state,
                               const ActiveContact& contact) {
  for (const ActiveContact& other : touching_.contacts) {
    if (other.SameAs(contact)) {
      return;
    }
  }
  const ContactSpeeds speeds = SpeedsOf(model, state, contact);
  touching_.contacts.push_back(contact);
  touching_.friction.push_back(FrictionOf(model, contact));
  touching_.restitution.push_back(RestitutionOf(model, contact));
  touching_.approach.push_back(speeds.normal);
  touching_.slip.push_back(speeds.slip);
  std::vector<ActiveContact> with_rolling = {contact};
  if (AppendRolling(model, &with_rolling)) AddTouching(model, state, with_rolling.back());
}

namespace {

// Whether a body moves from the tile of one contact to that of the other one. The tiles are convex
// and lie side by side, so that the way between their origins tells on which side each is.
bool GoesOnTo(const Model<double>& model, const State<double>& state, const ActiveContact& from,
              const ActiveContact& to) {
  const std::vector<BodyIndex>& bodies = model.structure->bodies;
  const auto tile = [&](const ActiveContact& c) { return bodies[c.a].block >= 0 ? c.b : c.a; };
  const int body = bodies[from.a].block >= 0 ? from.a : from.b;
  double along = 0.0;
  for (int k = 0; k < 2; ++k) {
    along += (state.pose[3 * tile(to) + k] - state.pose[3 * tile(from) + k]) *
             (state.twist[3 * body + k] - state.twist[3 * tile(from) + k]);
  }
  return along > 0.0;
}

// Keeps one of the contacts of a body that is exactly above a seam: the nearest, because on both
// sides of a step that counts as flush it cannot rest; and of two whose gaps differ by rounding the
// one onto which the body moves, because the other one would be lost at once.
void KeepOneOwner(const Model<double>& model, const State<double>& state, const Lengths& lengths,
                  std::vector<ActiveContact>* contacts) {
  const auto geometry_of = [&](const ActiveContact& contact) {
    ContactRows<double> rows;
    EvaluateContactRows(model, state, contact, &rows);
    return rows.geometry;
  };
  const auto is_preferred = [&](const ActiveContact& other, const ActiveContact& contact) {
    const double rounding = kLeftAlone * lengths.Rounding(state, contact.a, contact.b);
    if (std::abs(other.gap - contact.gap) > rounding) return other.gap < contact.gap;
    const bool goes_on = GoesOnTo(model, state, contact, other);
    return goes_on == GoesOnTo(model, state, other, contact) ? &other < &contact : goes_on;
  };
  for (size_t i = contacts->size(); i-- > 0;) {
    const ActiveContact& contact = (*contacts)[i];
    const ContactGeometry<double> own = geometry_of(contact);
    const bool is_second =
        std::any_of(contacts->begin(), contacts->end(), [&](const ActiveContact& other) {
          return AreOfOneSeam(model, other, geometry_of(other), contact, own) &&
                 is_preferred(other, contact);
        });
    if (is_second) contacts->erase(contacts->begin() + static_cast<std::ptrdiff_t>(i));
  }
}

// A vertex that several contacts hold is one point for all of them (ContactFeature::is_at_vertex).
void MarkSharedVertices(const Model<double>& model, std::vector<ActiveContact>* contacts) {
  struct Corner {
    int body = -1, part = 0, vertex = 0;
    bool operator==(const Corner&) const = default;
  };
  const auto corner_of = [&](const ActiveContact& contact) {
    const ContactFeature& feature = contact.feature;
    const bool is_first =
        feature.kind == FeatureKind::kVertexEdge || feature.kind == FeatureKind::kVertexPlane;
    if (!contact.IsOfShapes() || feature.kind == FeatureKind::kVertexVertex ||
        IsRound(is_first ? ShapeOfA(model, contact) : ShapeOfB(model, contact))) {
      return Corner{};
    }
    return is_first ? Corner{contact.a, feature.part_a, feature.a}
                    : Corner{contact.b, feature.part_b, feature.b};
  };
  for (size_t i = 1; i < contacts->size(); ++i) {
    const Corner corner = corner_of((*contacts)[i]);
    if (corner.body < 0) continue;
    for (size_t k = 0; k < i; ++k) {
      if (!(corner_of((*contacts)[k]) == corner)) continue;
      (*contacts)[i].feature.is_at_vertex = (*contacts)[k].feature.is_at_vertex = true;
    }
  }
}

}  // namespace

void EventStepper::FindTouching(const Model<double>& model, const State<double>& state) {
  const ModelStructure& structure = *model.structure;
  const Lengths& lengths = search_.lengths();
  touching_ = Touching();
  double reach = 0.0;
  for (int body = 0; body < structure.num_bodies(); ++body) {
    reach = std::max(reach, lengths.Touch(state, body, body));
  }
  std::vector<ActiveContact> found;
  search_.FindContacts(model, state, reach, &found);
  if (model.seams != nullptr) KeepOneOwner(model, state, lengths, &found);
  const double slow = search_.SpeedTolerance(model, state);
  for (const ActiveContact& contact : found) {
    const double touch = lengths.Touch(state, contact.a, contact.b);
    if (contact.gap > touch) {
      continue;
    }
    const double approach = SpeedsOf(model, state, contact).normal;
    const double size = std::min(lengths.radius(contact.a), lengths.radius(contact.b));
    ContactsAhead ahead;
    if (approach < -slow && size > 0.0) {
      ahead = FindContactsAhead(model, state, contact, approach, size, touch, slow);
    }
    if (ahead.count == 0) {
      const size_t first = touching_.contacts.size();
      AddTouching(model, state, contact);
      // What passes by at this instant touches, and opens.
      const bool passes = approach < -slow && size > 0.0 && HaveCorners(structure, contact) &&
                          PassesBy(model, state, contact, approach, size, slow);
      if (passes) {
        std::fill(touching_.approach.begin() + static_cast<std::ptrdiff_t>(first),
                  touching_.approach.end(), HUGE_VAL);
      }
    }
    for (int k = 0; k < ahead.count; ++k) {
      AddTouching(model, state, ahead.contacts[k]);
    }
  }
  found.clear();
  AppendLimits(model, state, &found);
  for (ActiveContact& limit : found) {
    ContactRows<double> rows;
    EvaluateActiveRows(model, state, limit, &rows);
    limit.gap = rows.geometry.gap;
    if (limit.gap <= lengths.LimitTouch(state, structure.joints[limit.joint])) {
      AddTouching(model, state, limit);
    }
  }
  found.clear();
  AppendJointFriction(model, state, &found);
  for (const ActiveContact& contact : found) {
    AddTouching(model, state, contact);
  }
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    ActiveContact& contact = touching_.contacts[i];
    // Rolling friction keeps the feature of its contact, which stands before it.
    if (contact.is_rolling && i > 0) contact.feature = touching_.contacts[i - 1].feature;
    if (contact.IsOfShapes()) TakeEdgeAhead(model, state, &contact);
  }
  MarkSharedVertices(model, &touching_.contacts);
}

int EventStepper::StuckLimit(const Model<double>& model, const State<double>& state, double moved) {
  constexpr int kMostSteps = 10;
  std::vector<BrokenLimit> broken;
  int stuck = -1;
  for (size_t i = 0; i < touching_.contacts.size(); ++i) {
    const ActiveContact& limit = touching_.contacts[i];
    if (limit.joint < 0 ||
        !(limit.gap < -kBrokenTouches * search_.TouchTolerance(model, state, limit))) {
      continue;
    }
    int steps = 0;
    for (const BrokenLimit& last : guess_.broken_limits) {
      if (last.limit.SameAs(limit) && std::abs(last.limit.gap - limit.gap) <= kStuckLimit * moved) {
        steps = last.steps + 1;
      }
    }
    stuck = moved > 0.0 && steps > kMostSteps ? static_cast<int>(i) : stuck;
    broken.push_back({limit, steps});
  }
  guess_.broken_limits.swap(broken);
  return stuck;
}

}  // namespace tangible
