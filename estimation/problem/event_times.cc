// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/event_times.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/dynamics/elements/part_pairs.h"
#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/geometry/mass_properties.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

bool IsOfPair(const ActiveContact& contact, const ObservedEvent& event) {
  return contact.IsOfShapes() && ((contact.a == event.bodies[0] && contact.b == event.bodies[1]) ||
                                  (contact.a == event.bodies[1] && contact.b == event.bodies[0]));
}

bool IsInIsland(const IslandRecord& island, const ObservedEvent& event) {
  return island.part == nullptr || (island.part->LocalBody(event.bodies[0]) >= 0 &&
                                    island.part->LocalBody(event.bodies[1]) >= 0);
}

/// The nearest features of two bodies; false where they have none.
bool FindNearest(const Model<double>& model, const State<double>& state, const ObservedEvent& event,
                 ActiveContact* nearest) {
  const int a = std::min(event.bodies[0], event.bodies[1]);
  const int b = std::max(event.bodies[0], event.bodies[1]);
  bool any = false;
  ForEachPart(model, a, b, [&](PartPair parts) {
    ContactFeature features[2];
    const int count = FindFeatures(model, a, state.PoseOf(a), b, state.PoseOf(b), parts,
                                   std::numeric_limits<double>::infinity(), features);
    for (int k = 0; k < count; ++k) {
      const double gap = EvaluateContact(features[k], model.Shape(a, parts.a), state.PoseOf(a),
                                         model.Shape(b, parts.b), state.PoseOf(b))
                             .gap;
      if (any && gap >= nearest->gap) continue;
      nearest->a = a;
      nearest->b = b;
      nearest->feature = features[k];
      nearest->gap = gap;
      any = true;
    }
  });
  return any;
}

double SmallerRadius(const Model<double>& model, const ActiveContact& contact) {
  const double radius =
      std::min(BoundingRadius(ShapeOfA(model, contact)), BoundingRadius(ShapeOfB(model, contact)));
  return std::isfinite(radius) && radius > 0.0 ? radius : 1.0;
}

}  // namespace

EventTimes::EventTimes(std::vector<ObservedEvent> events,
                       const std::vector<Observation>& observations)
    : events_(std::move(events)) {
  for (const Observation& observation : observations) {
    row_of_.push_back(observation.event < 0 ? -1 : num_rows());
    if (observation.event < 0) continue;
    rows_.emplace_back();
    rows_.back().event = observation.event;
    rows_.back().number = observation.number;
  }
}

void EventTimes::Start() {
  for (Row& row : rows_) row.found = -1;
  watches_.assign(events_.size(), Watch());
}

void EventTimes::Add(long k, const Stepper* stepper) {
  if (rows_.empty() || stepper == nullptr) return;
  const IslandRecords& records = stepper->parts();
  h_ = records.h;
  for (size_t e = 0; e < events_.size(); ++e) {
    bool any = false;
    for (int i = 0; i < records.num_islands; ++i) {
      const IslandRecord& island = *records.islands[i];
      if (!IsInIsland(island, events_[e])) continue;
      any = true;
      for (int p = 0; p < island.events.num_parts; ++p) {
        const EventPart& part = *island.events.parts[p];
        if (part.is_impulses) continue;
        const Segment& segment = part.segment;
        const Found end{segment.time + segment.length, {k - 1, i, p}, segment.end_dot};
        AddPart(events_[e], island, segment, end, &watches_[e]);
      }
    }
    // Bodies that no island has together are apart.
    if (!any) watches_[e].state = PairState::kOpen;
  }
}

// `end` is the segment's end.
void EventTimes::AddPart(const ObservedEvent& event, const IslandRecord& island,
                         const Segment& segment, const Found& end, Watch* watch) const {
  PairState state = PairState::kOpen;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact contact = island.InWhole(segment.contacts[i]);
    if (!IsOfPair(contact, event)) continue;
    watch->contact = contact;
    const bool sticks = segment.modes[i] == ContactMode::kSticking;
    if (sticks || state == PairState::kOpen) {
      state = sticks ? PairState::kSticking : PairState::kClosed;
    }
  }
  // Segments of no length stand between events at one instant.
  if (segment.length > kNoMotion * h_) {
    AddTransition(event.kind, state, segment.time, watch);
    watch->state = state;
  }
  if (segment.event == EventKind::kStepEnd) return;
  watch->last = end;
  const bool touches = segment.event == EventKind::kTouch && watch->state == PairState::kOpen &&
                       IsOfPair(island.InWhole(segment.event_contact), event);
  const bool again =
      !watch->found.empty() && end.time - watch->found.back().time <= kSameInstant * h_;
  if (event.kind == ObservedEventKind::kTouch && touches && !again) watch->found.push_back(end);
}

void EventTimes::AddTransition(ObservedEventKind kind, PairState next, double time,
                               Watch* watch) const {
  const PairState before = watch->state;
  const bool was_closed = before == PairState::kClosed || before == PairState::kSticking;
  const bool is_wanted =
      (kind == ObservedEventKind::kLiftOff && was_closed && next == PairState::kOpen) ||
      (kind == ObservedEventKind::kRest && before == PairState::kOpen &&
       next != PairState::kOpen) ||
      (kind == ObservedEventKind::kStick && before == PairState::kClosed &&
       next == PairState::kSticking) ||
      (kind == ObservedEventKind::kSlip && before == PairState::kSticking &&
       next == PairState::kClosed);
  if (!is_wanted) return;
  // Without an event the change is at the end of a step, whose time is given.
  const bool is_event =
      watch->last.at.part >= 0 && std::abs(watch->last.time - time) <= kSameInstant * h_;
  watch->found.push_back(is_event ? watch->last : Found{time, {}, {}});
}

void EventTimes::Finish(const Model<double>& model, const State<double>& final) {
  for (Row& row : rows_) {
    const std::vector<Found>& found = watches_[row.event].found;
    row.by_end.clear();
    row.missing = row.number > static_cast<int>(found.size());
    if (row.missing) {
      FinishMissing(model, final, &row);
      continue;
    }
    row.found = row.number - 1;
    row.value = FoundOf(row).time;
  }
}

void EventTimes::FinishMissing(const Model<double>& model, const State<double>& final,
                               Row* row) const {
  const ObservedEvent& event = events_[row->event];
  const Watch& watch = watches_[row->event];
  const double end = model.structure->settings.duration;
  const bool is_open = watch.state == PairState::kOpen || watch.state == PairState::kUnknown;
  const bool slides = event.kind == ObservedEventKind::kStick && watch.state == PairState::kClosed;
  row->found = -1;
  row->value = end;
  ActiveContact contact = watch.contact;
  if (is_open ? !FindNearest(model, final, event, &contact) : !slides) {
    if (watch.found.empty()) return;
    row->found = static_cast<int>(watch.found.size()) - 1;
    row->value = FoundOf(*row).time;
    return;
  }
  LocalJacobianScratch scratch;
  double distance = 0.0;
  double factor = 1.0;
  if (is_open) {
    distance = std::max(0.0, contact.gap);
    AddGapGradient(model, final, contact, &scratch, &row->by_end);
  } else {
    const double slip = SpeedsOf(model, final, contact).slip;
    distance = std::abs(slip) * end;
    factor = slip < 0.0 ? -end : end;
    AddSlipGradient(model, final, contact, &scratch, &row->by_end);
  }
  const double length = SmallerRadius(model, contact);
  const double sum = distance + length;
  row->value = end + end * distance / sum;
  for (JacobianEntry& entry : row->by_end) entry.value *= factor * end * length / (sum * sum);
}

}  // namespace tangible
