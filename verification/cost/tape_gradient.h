// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The gradient by a general-purpose tape, for comparison: ADOL-C's `adouble` as the scalar of the
// engine's templates. Every operation of the assembly and of the interior point is recorded, as
// with unrolled Jets; one reverse sweep over the tape gives the gradient for any number of
// parameters. Source: A. Walther, A. Griewank, Getting started with ADOL-C, in: Combinatorial
// Scientific Computing, 2012.

#include <vector>

#include "tangible/simulation/gradient/gradient.h"

namespace tangible::cost {

/// Whether ADOL-C was found when this was built.
bool TapeIsBuilt();

/// The same as LossGradient, for a scene with fixed steps; contacts are those of a run in double.
/// The timed part is that run, the recording and the reverse sweep.
GradientResult TapeLossGradient(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                const std::vector<LossTerm>& terms, int repeat);

}  // namespace tangible::cost
