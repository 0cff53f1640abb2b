// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Finds the contacts and joint limits that have rows in a step.
//
// Every pair whose gap is below margin + h (speed bound of a + speed bound of b) is listed, whether
// or not the free motion closes the gap, because another impact may close it. The result does not
// depend on which open contacts are listed. A bound is the larger of the speeds before and after
// the step without contacts; after the solve CheckBounds says whether a body is faster than its
// bound, and if so the search is repeated.

#include <span>
#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/elements/contacts_ahead.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/geometry/broad_phase.h"

namespace tangible {

class ContactSearch {
 public:
  explicit ContactSearch(const Model<double>& model);

  /// Starts a step: sets the bounds from the state and the free twists p / M of the assembled
  /// problem.
  void SetBounds(const Model<double>& model, const State<double>& state,
                 const ContactProblem<double>& problem, const AssemblyScratch<double>& scratch);
  /// Raises the bounds to the solved twists and returns whether any body was faster than its bound.
  bool CheckBounds(const Model<double>& model, const std::vector<double>& twist,
                   const AssemblyScratch<double>& scratch);
  /// The contacts in ascending order of bodies, then the limits, with their laws and coefficients.
  void Find(const Model<double>& model, const State<double>& state, double h,
            const AssemblyScratch<double>& scratch, std::vector<ActiveContact>* contacts,
            std::vector<CoefficientSource>* friction, std::vector<CoefficientSource>* restitution);
  /// Forgets the boxes of earlier searches: the next may be of other shapes.
  void Forget() { kept_.clear(); }
  /// Counts of the last search: the pairs of boxes that were compared, the pairs that overlap, and
  /// those among them that have no row because they are out of reach.
  int num_compared() const { return compared_; }
  int num_pairs() const { return static_cast<int>(pairs_.size()); }
  int num_beyond_reach() const { return beyond_reach_; }

  /// Of the bodies that the given contact connects, directly or through others (−1: of all), the
  /// contacts that rebound no longer do, but land as those without restitution; false where none
  /// does. Newton's law may ask for speeds that walls do not allow: a ball that fits exactly
  /// between two would have to rebound from one and may not move towards the other.
  static bool GiveUpRebounds(const Model<double>& model, double h, int contact,
                             std::vector<ActiveContact>* contacts);
  /// What an earlier solve of the step has given up stays so.
  static void KeepGivenUp(const Model<double>& model, double h,
                          const std::vector<ActiveContact>& earlier,
                          std::vector<ActiveContact>* contacts);

 private:
  void AddReached(const Model<double>& model, const State<double>& state, double h,
                  const AssemblyScratch<double>& scratch, ActiveContact contact, PartPair parts,
                  std::span<const ContactFeature> listed,
                  std::vector<ActiveContact>* contacts) const;
  double SlowApproach(const State<double>& state, const ActiveContact& contact, double h) const;
  double SmallerRadius(const ActiveContact& contact) const;
  bool PassesCorner(const Model<double>& model, const State<double>& state,
                    const ActiveContact& contact, double approach, double h) const;
  ContactsAhead FindPassed(const Model<double>& model, const State<double>& state,
                           const ActiveContact& contact, double approach, double h) const;
  Aabb BoxAt(const Model<double>& model, const State<double>& state,
             const AssemblyScratch<double>& scratch, int body, double growth) const;
  double GrowthOf(const Model<double>& model, double h, int body) const;
  bool BoxesHold(const Model<double>& model, const State<double>& state, double h) const;
  void FindPairs(const Model<double>& model, const State<double>& state, double h,
                 const AssemblyScratch<double>& scratch);
  double ReachOf(const Model<double>& model, const State<double>& state, double h, int a,
                 int b) const;
  void FindContacts(const Model<double>& model, const State<double>& state, double h,
                    const AssemblyScratch<double>& scratch, ActiveContact contact, PartPair parts,
                    std::vector<ActiveContact>* contacts) const;
  bool Rebounds(const Model<double>& model, const State<double>& state, double h,
                const ActiveContact& contact, const ContactRows<double>& rows) const;
  void FindLimits(const Model<double>& model, const State<double>& state, double h,
                  const AssemblyScratch<double>& scratch, std::vector<ActiveContact>* contacts);

  // Inserts rolling friction after the contacts that have it.
  void AddRolling(const Model<double>& model, std::vector<ActiveContact>* contacts,
                  std::vector<CoefficientSource>* friction,
                  std::vector<CoefficientSource>* restitution);

  Lengths lengths_;
  std::vector<double> bound_;          ///< m/s a body
  std::vector<ActiveContact> limits_;  ///< of all joints
  std::vector<ActiveContact> without_rolling_;
  std::vector<double> limit_bound_;  ///< a joint: bound on its coordinate's rate, rad/s or m/s
  /// Where a body's larger box was made, which holds until the body or its reach leaves it.
  struct KeptBox {
    double pose[3];
    double growth;  ///< m beyond the shape
    bool turns;     ///< a half-plane that turns
  };
  std::vector<KeptBox> kept_;                    ///< empty: none
  std::vector<Aabb> larger_;                     ///< those boxes
  std::vector<std::pair<int, int>> candidates_;  ///< the pairs of larger boxes that overlap
  std::vector<Aabb> boxes_;                      ///< of the bodies of these pairs, as they are
  std::vector<bool> boxed_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<double> free_twist_;
  BroadPhase broad_phase_;
  int compared_ = 0;
  int beyond_reach_ = 0;
};

}  // namespace tangible
