// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The bounds on the costs, and where one method becomes cheaper than another.

#include <string>
#include <vector>

#include "tangible/verification/cost/cost_run.h"

namespace tangible::cost {

/// The stated bounds: multiples of a rollout, for runs of at least `least_steps` steps (shorter
/// ones last a millisecond, which includes building the problem).
struct CostBounds {
  long least_steps = 1000;
  double adjoint = 2.0;        ///< any number of parameters
  double tangent = 3.0;        ///< up to 8 parameters
  double implicit_jet = 4.0;   ///< up to 8 parameters, where the widest Jet has 8 derivatives
  long long_run = 10000;       ///< steps of the run whose memory is bounded
  double long_run_mib = 64.0;  ///< resident memory of the whole process, 2^20 bytes
  double runs_again = 2.0;     ///< extra rollouts of that run
};

struct CheckedBound {
  std::string what;
  double limit = 0.0;
  double measured = 0.0;  ///< NaN where it was not checked
  std::string why_not;    ///< why it was not checked
  bool holds() const { return !why_not.empty() || measured <= limit; }
};

/// `long_run`: the adjoint with checkpoints for a run of that many steps.
std::vector<CheckedBound> CheckBounds(const CostBounds& bounds, const std::vector<CostCell>& cells,
                                      const CostCell& long_run);

/// The first bound, or failed cell, that is broken as one line, or empty.
std::string BrokenBound(const std::vector<CheckedBound>& bounds,
                        const std::vector<CostCell>& cells);

struct Crossover {
  long steps = 0;
  CostMethod method = CostMethod::kAdjoint, other = CostMethod::kDifferences;
  /// The number of parameters above which the method takes less time than the other, interpolated
  /// in logarithms between measured numbers; NaN: none within the measured range.
  double parameters = 0.0;
  bool from_the_first = false;  ///< already at the least number measured
};

/// Compares all other methods with central differences, and the adjoint with the tangent.
std::vector<Crossover> Crossovers(const std::vector<CostCell>& cells);

}  // namespace tangible::cost
