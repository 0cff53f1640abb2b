// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The contacts that touch at an instant, in groups that have one impact each: those of bodies that
// joints and touching contacts connect (coupled_bodies.h). Where several contacts of such a group
// approach as its first impact at the instant is found, contacts that do not act on each other
// (coupled_contacts.h) are groups of their own: a disc without friction that meets a floor and a
// wall at once has an impact with each, with a time of its own.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/simulation/events/coupled_bodies.h"

namespace tangible {

class ImpactGroups {
 public:
  /// What is known of the touching contacts.
  struct Touching {
    const std::vector<ActiveContact>& contacts;
    const std::vector<CoefficientSource>& friction;
    const std::vector<CoefficientSource>& restitution;
    const std::vector<double>& approach;  ///< n v, m/s
  };

  /// At a new instant, where nothing has struck yet.
  void Begin(const ModelStructure& structure);
  /// Finds the groups of the contacts that touch now; contacts that approach by more than `slow`
  /// (m/s) have impacts.
  void Connect(const Model<double>& model, const State<double>& state, double t,
               const Touching& touching, double slow);

  /// The group of touching contact i.
  int Of(size_t i) const { return groups_[i]; }
  /// The group of a contact that may no longer touch: then that of its bodies, which is −1 where
  /// these have several.
  int Of(const ActiveContact& contact);
  /// The approach before the group's last impact at this instant, m/s; 0: there was none.
  double Struck(int group) const;
  void SetStruck(int group, double approach);
  bool any_struck() const { return any_struck_; }

 private:
  struct Strike {
    ActiveContact contact;
    double approach = 0.0;
  };
  bool IsSplit(int bodies);
  void Split(const Model<double>& model, const State<double>& state, double t,
             const Touching& touching, int bodies, double slow);

  CoupledBodies bodies_;
  const ModelStructure* structure_ = nullptr;
  std::vector<ActiveContact> contacts_;  ///< that touch
  std::vector<int> groups_;              ///< of each: of its bodies, or a number beyond all bodies
  int num_groups_ = 0;                   ///< at least the number of bodies
  std::vector<double> struck_;           ///< of bodies
  std::vector<char> split_;      ///< of bodies: whether their contacts are in several groups
  std::vector<Strike> strikes_;  ///< of contacts of such bodies
  bool any_struck_ = false;
};

}  // namespace tangible
