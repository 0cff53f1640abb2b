// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The reference with which a run through impacts is compared where it has an impact earlier or
// later than the plan that it follows (Kong, Li, Council, Johnson, "iLQR for piecewise-smooth
// hybrid dynamical systems", arXiv 2103.14584):
//
//   u_k = ū_k + α k_k + K (x_k − x̄_k)
//
// Between the two impacts the states differ by the jump, however near the motions are, and the
// feedback would act on it. There the plan's motion is extended instead: forwards without the
// impact from the last of its states in the run's mode, or backwards from the first:
//
//   late    x̄_j, …, f̃(f̃(x̄_j, ū_j), ū_{j+1}), …      f̃: the steps without the impact
//   early   f̃⁻¹(x̄_j, ū_{j−1}), …                    (StepMap::StepBack)
//
// with the gain of step j. A mode is the sequence of impacts so far.

#include <map>
#include <utility>
#include <vector>

#include "tangible/control/ilqr.h"

namespace tangible {

class ExtendedReference {
 public:
  struct Point {
    VectorX<double> state;
    long gain;  ///< step of the plan whose gain belongs to it; −1: none, as for the last state
  };

  /// The system and the plan, whose `impacts` are filled in, must outlive this object.
  ExtendedReference(StepMap* map, long first_step, const Plan& plan);

  /// The reference for step k of a run that has had `impacts`. Where the plan is never in that mode
  /// (its impacts are others, or two in a step), or the system has no steps without the impact, it
  /// is the plan's state of step k.
  const Point& At(long k, const std::vector<int>& impacts);

 private:
  /// The same for the mode after `count` impacts, of the plan's own sequence.
  const Point& InMode(long k, long count);
  Point Own(long k) const { return {plan_.states.row(k), k}; }
  Point Later(long k, long count);
  Point Earlier(long k, long count);

  StepMap* map_;
  long first_step_;
  const Plan& plan_;
  std::vector<int> impacts_;  ///< of the whole plan
  std::vector<long> so_far_;  ///< impacts before step k
  std::map<std::pair<long, long>, Point> points_;
};

}  // namespace tangible
