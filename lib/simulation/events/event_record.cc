// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_record.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

size_t BytesOf(const State<double>& state) {
  return sizeof(double) * (state.pose.capacity() + state.twist.capacity()) +
         state.servo_modes.capacity() + state.released.capacity();
}

// Bytes without the node itself, which is stored in a vector.
size_t BytesOf(const SolvedNode& node) {
  return BytesOf(node.state) + node.problem.bytes() + node.solution.bytes() + node.system.bytes();
}

size_t BytesOf(const std::vector<SolvedNode>& nodes) {
  size_t sum = nodes.capacity() * sizeof(SolvedNode);
  for (const SolvedNode& node : nodes) {
    sum += BytesOf(node);
  }
  return sum;
}

size_t BytesOf(const Impulses& impulses) { return impulses.bytes() + impulses.system.bytes(); }

size_t BytesOf(const Segment& segment) {
  return BytesOf(segment.before) + BytesOf(segment.after) +
         sizeof(ActiveContact) * segment.contacts.capacity() +
         sizeof(CoefficientSource) * segment.friction.capacity() +
         sizeof(ContactMode) * segment.modes.capacity() +
         sizeof(WindowEdge) * segment.further_edges.capacity() +
         sizeof(ReleaseRate) * segment.release.capacity() + BytesOf(segment.stages) +
         BytesOf(segment.corrections) + BytesOf(segment.projection) + BytesOf(segment.end) +
         sizeof(double) * static_cast<size_t>(segment.end_dot.size() + segment.end_bar.size());
}

}  // namespace

EventPart* EventRecord::Add() {
  if (num_parts == static_cast<int>(parts.size())) {
    parts.push_back(std::make_unique<EventPart>());
  }
  return parts[num_parts++].get();
}

bool Segment::HasRate(double rate, double terms) const {
  double least = kNoRate * terms;
  if (event == EventKind::kTouch && event_contact.IsOfShapes() && !passes) {
    double fastest = 0.0;
    for (const int body : {event_contact.a, event_contact.b}) {
      const double* const twist = &after.twist[3 * static_cast<size_t>(body)];
      fastest = std::max({fastest, std::abs(twist[0]), std::abs(twist[1])});
    }
    least = std::max(least, kTouchRounding * fastest);
  }
  return std::abs(rate) > least;
}

size_t EventRecord::bytes() const {
  size_t sum = parts.capacity() * sizeof(parts[0]);
  for (const std::unique_ptr<EventPart>& part : parts) {
    sum += sizeof(EventPart) + BytesOf(part->segment) + BytesOf(part->impulses);
  }
  return sum;
}

SolvedEquations StepRecord::View(const std::vector<int>& contact_block) const {
  SolvedEquations view;
  view.instant.t = time;
  view.instant.h = h;
  view.state = &before;
  view.new_twist = &new_twist;
  view.contacts = &contacts;
  view.friction = &friction;
  view.restitution = &restitution;
  view.problem = &problem;
  view.solution = &solution;
  view.contact_block = &contact_block;
  return view;
}

size_t StepRecord::bytes() const {
  return BytesOf(before) + sizeof(double) * new_twist.capacity() +
         sizeof(ActiveContact) * contacts.capacity() +
         sizeof(CoefficientSource) * (friction.capacity() + restitution.capacity()) +
         problem.bytes() + solution.bytes();
}

const char* NameOf(EventKind event) {
  switch (event) {
    case EventKind::kStepEnd:
      return "end of the step";
    case EventKind::kEdge:
      return "edge of a force's window";
    case EventKind::kTouch:
      return "touch";
    case EventKind::kSlipEnds:
      return "end of sliding";
    case EventKind::kSlipBegins:
      return "start of sliding";
    case EventKind::kLiftOff:
      return "lift-off";
    case EventKind::kServoBound:
      return "bound of a servo";
    case EventKind::kSupportStops:
      return "rest on a support";
    case EventKind::kSupportLetsGo:
      return "start of sliding on a support";
    case EventKind::kReturn:
      return "return into penetration";
    case EventKind::kAtOnce:
      return "return into penetration at once";
  }
  return "";
}

bool IsLocated(EventKind kind) {
  return kind != EventKind::kStepEnd && kind != EventKind::kEdge && kind != EventKind::kAtOnce;
}

SolvedEquations ViewOf(const Segment& segment, const SolvedNode& node, bool correction) {
  SolvedEquations view;
  view.level = correction ? Level::kCorrection : Level::kAcceleration;
  view.instant.time = node.time;
  view.instant.middle = segment.middle;
  view.state = &node.state;
  view.contacts = &segment.contacts;
  view.friction = &segment.friction;
  view.problem = &node.problem;
  view.solution = &node.solution;
  view.contact_block = &node.system.contact_block();
  return view;
}

}  // namespace tangible
