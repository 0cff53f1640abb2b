// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rebounds that come ever faster. A contact that an acceleration a presses together and that
// rebounds with e < 1 at a speed v has infinitely many impacts more, of speeds e v, e² v, …, which
// are over after
//
//   Δt = 2 v e / (a (1 − e)),    and rise to    e² v² / (2 a)                                   (1)
//
// Their impulses per unit of mass sum to v (1 + e) / (1 − e) = v + a Δt: those of an impact without
// a rebound at once, and of the contact force a during Δt. Where both of (1) are next to nothing
// the sequence therefore ends with such an impact: from t + Δt on the motion and its derivatives
// are those of the limit, and poses differ meanwhile by no more than the height.

#include <vector>

#include "tangible/dynamics/elements/contact.h"

namespace tangible {

/// The last rebound in a step of each contact.
class Rebounds {
 public:
  void Clear() { last_.clear(); }
  /// Whether the sequence of a contact's rebounds ends with an impact at `time`, approached at
  /// `speed` > 0, m/s: since its last rebound in the step, which was faster, the contact has been
  /// brought back by a steady acceleration, as fast as it left, by which (1) is less than `height`,
  /// m, and `duration`, s (rad/s and rad of a joint's angle).
  bool End(const ActiveContact& contact, double time, double speed, double restitution,
           double height, double duration) const;
  /// Notes a rebound.
  void Add(const ActiveContact& contact, double time, double speed, double restitution);

 private:
  struct Rebound {
    ActiveContact contact;
    double time, speed;  ///< at which it was approached
    double leaves;       ///< the speed at which it left
  };
  std::vector<Rebound> last_;
};

}  // namespace tangible
