// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What would explain the residuals of a fit.
//
// At the estimate let r be the residuals and J their derivatives with respect to the free
// parameters. A candidate (missing_candidates.h) has columns G = ∂r/∂θ. What the free parameters
// cannot do of it explains of the sum of squares, to first order,
//
//   e = −G̃ G̃⁺ r,   G̃ = G − J J⁺ G         share = |e|² / |r|²                       (1)
//
// With one column this is Rao's score statistic, (g̃·r)² / (|g̃|² |r|²). A joint made softer is tried
// at several stiffnesses k: with the residuals r_k and derivatives J_k there, which include those
// by k,
//
//   e = r − (r_k − J_k J_k⁺ r_k)            share = 1 − |r − e|² / |r|²               (2)
//
// Candidates that explain the same, |e_a − e_b|² ≤ max(kSameExplained |e_a| |e_b|, kNoiseOfOne s²)
// with the deviation s of what nothing explains, cannot be told apart by these residuals: they are
// one row, named by the one that explains most for its number of columns. What is to first order
// may be far from the truth: the best are fitted for real, to all observations and to the first
// part of each recording, after which the rest is predicted,
//
//   gain = 1 − (sum of squares of the rest with the candidate) / (without)            (3)
//
// and only what lowers the cost by more than chance and has a gain > 0 is `confirmed`.
//
// References: those of held_parameters.h.

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/missing_candidates.h"

namespace tangible {

struct MissingOptions {
  double least_deviations = 5.0;  ///< of chance, for a share to be worth a fit
  int most_confirmed = 3;         ///< candidates are fitted until so many are confirmed
  int most_fitted = 6;
  double fitted_part = 0.7;  ///< of each recording's time; the rest is predicted
  int most_numbers = 400;    ///< of the scene
  int most_rows = 20;
};

struct MissingRow {
  std::string candidate;
  MissingKind kind = MissingKind::kNumber;
  std::vector<std::string> parameters;
  std::vector<double> held;             ///< their values without
  std::vector<double> first_order;      ///< and to first order with
  double cost_share = 0.0;              ///< (1) or (2), 0 to 1
  std::vector<std::string> equivalent;  ///< candidates that explain the same
  bool refitted = false;
  std::vector<double> values;   ///< of the real fit
  double refitted_share = NAN;  ///< of the cost, by which it falls in the real fit
  double held_out_gain = NAN;   ///< (3); NaN: nothing was fitted or held back
  bool confirmed = false;
};

struct MissingResult {
  /// Those confirmed by the share of the real fit, then the others by cost_share.
  std::vector<MissingRow> rows;
  double chance = 0.0;  ///< a share that chance may give a candidate of one number
  int tested = 0;       ///< candidates that had a run
  long rollouts = 0;
  double seconds = 0.0;
  std::string message;  ///< why there are no rows, or empty
};

/// `input` has the sigma of `problem`, whose fit `result` is with an estimate.
MissingResult FindMissing(const MissingOptions& options, const FitInput& input,
                          const FitResult& result, RecordingsProblem* problem);

/// One sentence: what was found.
std::string Conclusion(const MissingResult& missing);

}  // namespace tangible
