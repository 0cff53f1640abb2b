// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tests whether residuals are consistent with the model: not larger than sigma explains, and not
// correlated in time (whiteness.h).

#include <cmath>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"
#include "tangible/estimation/uncertainty/whiteness.h"

namespace tangible {

struct ResidualQuality {
  double residual_rms = 0.0;  ///< in multiples of sigma
  /// Σ r² / (N − free parameters), with random forces (Σ r² + Σ ε²) / (N − free parameters); NaN
  /// where N is not larger.
  double reduced_chi_square = 0.0;
  Whiteness whiteness;
  bool too_large = false;   ///< larger than sigma explains
  bool correlated = false;  ///< in time; not tested with random forces
  bool has_forces = false;  ///< random ones (process_noise.h)
  bool DoesNotFit() const { return too_large || correlated; }
  /// Whether another minimum may fit better. Residuals that are large but independent mean that
  /// sigma is too small; the correlation of few residuals is not known.
  bool MayBeLocal() const {
    return correlated || (too_large && !std::isfinite(whiteness.correlation));
  }
};

/// Judges the rows of the observations of all blocks, for a fit with this number of free
/// parameters.
ResidualQuality JudgeResiduals(const LeastSquaresProblem& problem,
                               const std::vector<BlockEvaluation>& blocks, int num_free);

}  // namespace tangible
