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
    case ContactChange::Kind::kReversed:
      return "a slip that turns back";
  }
  return "";
}

// The sign of a slip at the end of the step; 0 where it rests or moves by rounding.
double SlidesTo(const StepRecord& record, size_t i) {
  const double sign = SlidingSign(record.solution.modes[i]);
  if (sign == 0.0) return 0.0;
  const ContactBlock<double>& block = record.problem.contacts[i];
  double slip = block.c_t, terms = std::abs(block.c_t);
  const auto add = [&](int moving, const RowPart<double>& row) {
    if (moving < 0) return;
    for (int k = 0; k < 3; ++k) {
      const double term = row[k] * record.solution.motion[3 * moving + k];
      slip += term;
      terms += std::abs(term);
    }
  };
  add(block.a, block.tangent_a);
  add(block.b, block.tangent_b);
  return sign * slip > kSlipRounding * terms ? sign : 0.0;
}

bool IsBefore(const ActiveContact& x, const ActiveContact& y) {
  return std::pair(x.a, x.b) < std::pair(y.a, y.b);
}

template <typename Entry>
void Order(std::vector<Entry>* entries) {
  std::sort(entries->begin(), entries->end(),
            [](const Entry& x, const Entry& y) { return IsBefore(x.contact, y.contact); });
}

// The first of ordered entries between the bodies of a contact that is accepted, or null.
template <typename Entry, typename Accept>
Entry* Find(std::vector<Entry>* entries, const ActiveContact& contact, const Accept& accept) {
  auto found = std::lower_bound(
      entries->begin(), entries->end(), contact,
      [](const Entry& entry, const ActiveContact& c) { return IsBefore(entry.contact, c); });
  for (; found != entries->end() && !IsBefore(contact, found->contact); ++found) {
    if (accept(*found)) return &*found;
  }
  return nullptr;
}

}  // namespace

std::string TextOf(const ModelStructure& structure, long step, double time,
                   const ContactChange& change) {
  return PlaceText(structure, step, time, change.contact) + ", " + NameOf(change.kind);
}

DiscreteMapWatch::Touch* DiscreteMapWatch::FindLast(const ActiveContact& contact) {
  return Find(&last_, contact, [&](const Touch& touch) { return touch.contact.SameAs(contact); });
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
  return Find(&last_, contact, [&](const Touch& touch) {
    return !touch.continues && touch.contact.IsOfTheSameShapes(contact);
  });
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

void DiscreteMapWatch::AddSlides(const StepRecord& record) {
  slides_now_.clear();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    const ContactBlock<double>& block = record.problem.contacts[i];
    if (!block.has_friction && !block.limit_given) continue;
    const double sign = SlidesTo(record, i);
    const Slide* const last =
        Find(&slides_, contact, [&](const Slide& slide) { return slide.contact.SameAs(contact); });
    if (sign != 0.0) {
      if (last != nullptr && last->sign == -sign) {
        changes_.push_back({ContactChange::Kind::kReversed, contact});
      }
      slides_now_.push_back({contact, sign});
    } else if (last != nullptr && !last->ended) {
      slides_now_.push_back({contact, last->sign, true});
    }
  }
  Order(&slides_now_);
  slides_.swap(slides_now_);
}

void DiscreteMapWatch::AddSupportSlides(const Model<double>& model, const StepRecord& record) {
  const ModelStructure& s = *model.structure;
  if (record.before.supports.size() != s.supports.size()) return;
  support_slides_.resize(s.supports.size());
  for (size_t k = 0; k < s.supports.size(); ++k) {
    const int body = s.supports[k].body;
    support_.Set(model, record.before, s.supports[k], 1.0);
    if (!(support_.limit() > 0.0)) continue;
    SupportSlide& last = support_slides_[k];
    if (HoldsCentre(s.supports[k], record.before.supports[k])) {
      // As for contacts, one step at rest may lie between a slip and the one back.
      if (std::exchange(last.ended, true)) last.twist = {};
      continue;
    }
    const double* v = &record.new_twist[3 * static_cast<size_t>(body)];
    const double arm = support_.arm();
    const double product =
        v[0] * last.twist[0] + v[1] * last.twist[1] + arm * arm * v[2] * last.twist[2];
    if (product < 0.0) {
      ActiveContact contact;
      contact.is_support = true;
      contact.a = body;
      contact.b = s.world();
      changes_.push_back({ContactChange::Kind::kReversed, contact});
    }
    std::copy_n(v, 3, last.twist.begin());
    last.ended = false;
  }
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
  Order(&now_);
  last_.swap(now_);
  AddSlides(record);
  AddSupportSlides(model, record);
  first_ = false;
  return changes_;
}

}  // namespace tangible
