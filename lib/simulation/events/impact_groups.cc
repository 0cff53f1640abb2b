// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/impact_groups.h"

#include <algorithm>

#include "tangible/simulation/events/coupled_contacts.h"

namespace tangible {

void ImpactGroups::Begin(const ModelStructure& structure) {
  structure_ = &structure;
  struck_.assign(structure.bodies.size(), 0.0);
  split_.assign(structure.bodies.size(), 0);
  strikes_.clear();
  any_struck_ = false;
}

void ImpactGroups::Connect(const Model<double>& model, const State<double>& state, double t,
                           const Touching& touching, double slow) {
  contacts_ = touching.contacts;
  bodies_.Connect(*structure_, contacts_);
  num_groups_ = structure_->num_bodies();
  for (const int body : structure_->moving) {
    const int group = bodies_.GroupOf(body);
    struck_[group] = std::max(struck_[group], struck_[body]);
    split_[group] = split_[group] || split_[body] ? 1 : 0;
  }
  groups_.clear();
  for (const ActiveContact& contact : contacts_) {
    groups_.push_back(bodies_.GroupOf(contact));
  }
  std::vector<int> approaching(structure_->bodies.size(), 0);
  for (size_t i = 0; i < contacts_.size(); ++i) {
    approaching[groups_[i]] += touching.approach[i] < -slow ? 1 : 0;
  }
  for (const int body : structure_->moving) {
    if (bodies_.GroupOf(body) != body) continue;
    if (IsSplit(body) || (approaching[body] > 1 && struck_[body] == 0.0)) {
      Split(model, state, t, touching, body, slow);
    }
  }
}

bool ImpactGroups::IsSplit(int bodies) { return bodies >= 0 && split_[bodies] != 0; }

void ImpactGroups::Split(const Model<double>& model, const State<double>& state, double t,
                         const Touching& touching, int bodies, double slow) {
  std::vector<size_t> members;
  std::vector<ActiveContact> contacts;
  std::vector<CoefficientSource> friction, restitution;
  std::vector<bool> wanted;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    // Friction in a joint is a force, which does nothing at an instant.
    if (groups_[i] != bodies || contacts_[i].IsJointFriction()) continue;
    members.push_back(i);
    contacts.push_back(contacts_[i]);
    friction.push_back(touching.friction[i]);
    restitution.push_back(touching.restitution[i]);
    wanted.push_back(IsSplit(bodies) || touching.approach[i] < -slow);
  }
  ContactProblem<double> problem;
  AssemblyScratch<double> scratch;
  AssembleWithoutContacts(model, state, t, 0.0, &problem, &scratch);
  AssembleContacts(model, state, 0.0, contacts, friction, restitution, &scratch, &problem);
  std::vector<int> parts = GroupsOfContacts(problem, wanted);
  // Rolling friction acts with the impulse of its contact.
  for (size_t k = 1; k < parts.size(); ++k) {
    if (contacts[k].is_rolling) parts[k] = parts[k - 1];
  }
  const int most = parts.empty() ? 0 : *std::max_element(parts.begin(), parts.end());
  if (most == 0 && !IsSplit(bodies)) return;
  for (const int body : structure_->moving) {
    if (bodies_.GroupOf(body) == bodies) split_[body] = 1;
  }
  for (size_t k = 0; k < members.size(); ++k) {
    groups_[members[k]] = num_groups_ + parts[k];
  }
  num_groups_ += most + 1;
}

int ImpactGroups::Of(const ActiveContact& contact) {
  const int bodies = bodies_.GroupOf(contact);
  if (!IsSplit(bodies)) return bodies;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (contacts_[i].SameAs(contact)) return groups_[i];
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (contacts_[i].IsBetweenTheSame(contact)) return groups_[i];
  }
  return -1;
}

double ImpactGroups::Struck(int group) const {
  if (group < static_cast<int>(struck_.size())) return struck_[group];
  double approach = 0.0;
  for (const Strike& strike : strikes_) {
    for (size_t i = 0; i < contacts_.size(); ++i) {
      if (groups_[i] == group && contacts_[i].SameAs(strike.contact)) approach = strike.approach;
    }
  }
  return approach;
}

void ImpactGroups::SetStruck(int group, double approach) {
  any_struck_ = true;
  for (const int body : structure_->moving) {
    if (bodies_.GroupOf(body) == group) struck_[body] = approach;
  }
  for (size_t i = 0; i < contacts_.size(); ++i) {
    if (groups_[i] != group || group < static_cast<int>(struck_.size())) continue;
    std::erase_if(strikes_, [&](const Strike& s) { return s.contact.SameAs(contacts_[i]); });
    strikes_.push_back({contacts_[i], approach});
  }
}

}  // namespace tangible
