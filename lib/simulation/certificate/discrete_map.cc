// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/discrete_map.h"

#include <algorithm>
#include <utility>

#include "tangible/geometry/tolerances.h"
#include "tangible/simulation/certificate/approach_inl.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/derivatives/rollout_directional.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Whether the contact closes without an impact: it does not approach, apart from rounding of a
// speed of which the normal part is 0.
bool ClosesGently(const Model<double>& model, const StepRecord& record, size_t i) {
  const Approach approach = ApproachOf(*model.structure, record, i);
  return record.contacts[i].law != ContactLaw::kRestitution &&
         approach.before >= -Negligible(model, approach.terms);
}

// The normal of a contact towards the body that forces move, of two such bodies the first.
Vector2<double> NormalOf(const Model<double>& model, const StepRecord& record, size_t i) {
  const ContactBlock<double>& block = record.problem.contacts[i];
  const bool first_moves = model.structure->bodies[record.contacts[i].a].block >= 0;
  const RowPart<double>& row = first_moves ? block.normal_a : block.normal_b;
  return {row[0], row[1]};
}

const char* NameOf(ContactChange::Kind kind) {
  switch (kind) {
    case ContactChange::Kind::kMade:
      return "made";
    case ContactChange::Kind::kBroken:
      return "broken";
    case ContactChange::Kind::kRestitution:
      return "an impact with restitution";
  }
  return "";
}

bool IsBefore(const ActiveContact& x, const ActiveContact& y) {
  return std::pair(x.a, x.b) < std::pair(y.a, y.b);
}

}  // namespace

std::string TextOf(const ModelStructure& structure, long step, double time,
                   const ContactChange& change) {
  return PlaceText(structure, step, time, change.contact) + ", " + NameOf(change.kind);
}

DiscreteMapWatch::Touch* DiscreteMapWatch::FindLast(const ActiveContact& contact) {
  auto found = std::lower_bound(
      last_.begin(), last_.end(), contact,
      [](const Touch& touch, const ActiveContact& c) { return IsBefore(touch.contact, c); });
  for (; found != last_.end() && !IsBefore(contact, found->contact); ++found) {
    if (found->contact.SameAs(contact)) return &*found;
  }
  return nullptr;
}

DiscreteMapWatch::Touch* DiscreteMapWatch::FindHandedOver(const Model<double>& model,
                                                          const Touch& touch) {
  if (model.seams == nullptr || !touch.contact.IsOfShapes()) return nullptr;
  const std::vector<BodyIndex>& bodies = model.structure->bodies;
  const auto moving = [&](const ActiveContact& c) { return bodies[c.a].block >= 0 ? c.a : c.b; };
  const auto driven = [&](const ActiveContact& c) { return bodies[c.a].block >= 0 ? c.b : c.a; };
  const int body = moving(touch.contact);
  if (bodies[driven(touch.contact)].block >= 0) return nullptr;
  for (Touch& last : last_) {
    if (!last.continues && last.contact.IsOfShapes() && moving(last.contact) == body &&
        bodies[driven(last.contact)].block < 0 &&
        (last.normal - touch.normal).norm() <= kFlushTurn) {
      return &last;
    }
  }
  return nullptr;
}

DiscreteMapWatch::Touch* DiscreteMapWatch::FindReplaced(const ActiveContact& contact) {
  auto found = std::lower_bound(
      last_.begin(), last_.end(), contact,
      [](const Touch& touch, const ActiveContact& c) { return IsBefore(touch.contact, c); });
  for (; found != last_.end() && !IsBefore(contact, found->contact); ++found) {
    if (!found->continues && found->contact.IsOfTheSameShapes(contact)) return &*found;
  }
  return nullptr;
}

bool DiscreteMapWatch::ExistsAtStart(const Model<double>& model, const StepRecord& record,
                                     size_t i) const {
  const ActiveContact& contact = record.contacts[i];
  const double touch =
      contact.joint >= 0
          ? lengths_.LimitTouch(record.before, model.structure->joints[contact.joint])
          : lengths_.Touch(record.before, contact.a, contact.b);
  return contact.gap <= kMeantTouches * touch && ClosesGently(model, record, i);
}

const std::vector<ContactChange>& DiscreteMapWatch::AddStep(const Model<double>& model,
                                                            const StepRecord& record) {
  changes_.clear();
  now_.clear();
  without_last_.clear();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (contact.IsPureFriction()) continue;
    const bool closed = record.solution.modes[i] != ContactMode::kOpen;
    if (!closed && !JustTouches(record, i)) continue;
    if (closed && contact.law == ContactLaw::kRestitution) {
      changes_.push_back({ContactChange::Kind::kRestitution, contact});
    }
    Touch* const last = FindLast(contact);
    const bool exists = last != nullptr || (first_ && ExistsAtStart(model, record, i));
    if (last != nullptr) last->continues = true;
    if (!exists && closed) without_last_.push_back(i);
    // One that reaches the surface as the step ends, without an impulse, is made in the next step.
    if (exists || closed) now_.push_back({contact, NormalOf(model, record, i)});
  }
  for (const size_t i : without_last_) {
    Touch* replaced = FindReplaced(record.contacts[i]);
    if (replaced == nullptr) {
      replaced = FindHandedOver(model, {record.contacts[i], NormalOf(model, record, i)});
    }
    if (replaced != nullptr && ClosesGently(model, record, i)) {
      replaced->continues = true;
    } else {
      changes_.push_back({ContactChange::Kind::kMade, record.contacts[i]});
    }
  }
  for (const Touch& touch : last_) {
    if (!touch.continues) changes_.push_back({ContactChange::Kind::kBroken, touch.contact});
  }
  std::sort(now_.begin(), now_.end(),
            [](const Touch& x, const Touch& y) { return IsBefore(x.contact, y.contact); });
  last_.swap(now_);
  first_ = false;
  return changes_;
}

}  // namespace tangible
