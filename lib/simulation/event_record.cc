// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/event_record.h"

namespace tangible {

EventPart* EventRecord::Add() {
  if (num_parts == static_cast<int>(parts.size())) {
    parts.push_back(std::make_unique<EventPart>());
  }
  return parts[num_parts++].get();
}

size_t EventRecord::bytes() const {
  size_t sum = 0;
  const auto states = [](const State<double>& s) {
    return sizeof(double) * (s.pose.size() + s.twist.size());
  };
  const auto node = [&](const SolvedNode& n) {
    return sizeof(SolvedNode) + states(n.state) + n.system.bytes() +
           sizeof(ContactBlock<double>) * n.problem.contacts.size() +
           sizeof(JointBlock<double>) * n.problem.joints.size();
  };
  for (int i = 0; i < num_parts; ++i) {
    const EventPart& part = *parts[i];
    const Segment& segment = part.segment;
    sum += sizeof(EventPart) + states(segment.before) + states(segment.after) +
           part.impulses.system.bytes() + segment.projection.system.bytes();
    for (int k = 0; k < segment.num_stages; ++k) {
      sum += node(segment.stages[k]);
    }
    for (int k = 0; k < segment.num_corrections; ++k) {
      sum += node(segment.corrections[k]);
    }
  }
  return sum;
}

SolvedStep Impulses::View() const {
  SolvedStep view;
  view.time = time;
  view.h = h;
  view.corrects_drift = false;
  view.before = &before;
  view.new_twist = &new_twist;
  view.contacts = &contacts;
  view.friction = &friction;
  view.restitution = &restitution;
  view.problem = &problem;
  view.solution = &solution;
  view.contact_block = &system.contact_block();
  return view;
}

SolvedAcceleration ViewOf(const Segment& segment, const SolvedNode& node, bool correction) {
  SolvedAcceleration view;
  view.correction = correction;
  view.time = node.time;
  view.middle = segment.middle;
  view.state = &node.state;
  view.contacts = &segment.contacts;
  view.friction = &segment.friction;
  view.problem = &node.problem;
  view.solution = &node.solution;
  view.contact_block = &node.system.contact_block();
  return view;
}

}  // namespace tangible
