// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The islands of a step by events: sets of moving bodies between which nothing can act within the
// step. Joints and springs connect bodies, and so do boxes that overlap when they are grown by what
// the bodies may move in the step,
//
//   reach = 1.5 h max(|v|, |v + h M⁻¹ f|)
//
// with the speed |v| of a body's fastest point and all forces but those of contacts and joints.
// Contacts may make bodies faster; that is found out afterwards (island_step.h). Fixed and
// kinematic bodies connect nothing: their motion is given.
//
// Bodies that no event is expected of are one island for as long as none is found, because bodies
// that move together cost less than each of them alone: those that nothing can touch, and those
// that are near no other bodies than those whose contacts the last step has left closed.

#include <utility>
#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/geometry/broad_phase.h"
#include "tangible/math/disjoint_sets.h"
#include "tangible/simulation/events/event_step.h"

namespace tangible {

class IslandPartition {
 public:
  explicit IslandPartition(const Model<double>& model);

  /// Whether joints and springs leave moving bodies unconnected at all.
  bool MayDivide() const { return may_divide_; }
  /// The reach of each body over a step of length h from t.
  void FindReach(const Model<double>& model, const State<double>& state, double t, double h);
  /// Which islands by these reaches are put together in island 0: those without expected events, or
  /// only bodies that nothing can touch and no joint or spring holds, which can have none.
  enum class Together { kWithoutExpected, kWithout };
  void Divide(const Model<double>& model, const State<double>& state, const EventGuess& last);
  /// Lists them.
  void List(const ModelStructure& structure, Together together);

  /// Each island's bodies in ascending order, with the fixed and kinematic ones that may act on
  /// them; island 0 may be empty.
  int num_islands() const { return num_islands_; }
  /// Whether island 0 is not all there is, or all there is beside it.
  bool IsDivided() const { return num_islands_ > 2 || (num_islands_ == 2 && !islands_[0].empty()); }
  const std::vector<int>& bodies(int island) const { return islands_[island]; }
  /// The island of a moving body.
  int IslandOf(int body) const { return island_of_[body]; }

  /// The reach of a moving body, m. A larger one than was found holds until the next FindReach.
  double reach(int body) const { return reach_[body]; }
  void SetReach(int body, double reach) { reach_[body] = reach; }
  /// The speed of the fastest point of a body with this twist, m/s.
  double SpeedOf(int body, const double* twist) const;
  const Lengths& lengths() const { return lengths_; }
  int num_compared() const { return broad_phase_.num_compared(); }

 private:
  void Join(int a, int b);
  void Connect(const ModelStructure& structure);

  Lengths lengths_;
  bool may_divide_ = false;
  int num_islands_ = 0;
  std::vector<std::vector<int>> islands_;
  std::vector<int> island_of_;
  DisjointSets moving_;
  // Of each body: whether something can touch it, or a joint or spring holds it; and whether, in
  // its island, something may touch that does not touch now.
  std::vector<char> busy_, expects_;
  std::vector<std::pair<int, int>> closed_;  ///< pairs, ascending
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::pair<int, int>> given_;  ///< a moving body, and a fixed or kinematic one near it
  std::vector<double> reach_;
  std::vector<Aabb> boxes_;
  BroadPhase broad_phase_;
  ContactProblem<double> free_;
  AssemblyScratch<double> scratch_;
};

}  // namespace tangible
