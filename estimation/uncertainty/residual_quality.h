// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether residuals are what a right model leaves: not larger than sigma explains, and not
// correlated in time (whiteness.h).

#include <cmath>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"
#include "tangible/estimation/uncertainty/whiteness.h"

namespace tangible {

struct ResidualQuality {
  double residual_rms = 0.0;        ///< in multiples of sigma
  double reduced_chi_square = 0.0;  ///< Σ r² / (N − free parameters); NaN where N is not larger
  Whiteness whiteness;
  bool too_large = false;   ///< larger than sigma explains
  bool correlated = false;  ///< in time
  bool DoesNotFit() const { return too_large || correlated; }
  /// Whether another minimum may fit better. Residuals that are large but independent are those of
  /// a sigma that is too small; of few the correlation is not known.
  bool MayBeLocal() const {
    return correlated || (too_large && !std::isfinite(whiteness.correlation));
  }
};

/// Of the observations' rows of all blocks, of a fit with so many free parameters.
ResidualQuality JudgeResiduals(const LeastSquaresProblem& problem,
                               const std::vector<BlockEvaluation>& blocks, int num_free);

}  // namespace tangible
