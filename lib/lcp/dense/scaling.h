// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Equilibration: positive diagonal R, C such that the largest entry in every row and column of
// R K C is near 1. They are powers of two, so that scaling causes no rounding. A friction-cone row
// with μ = 1e6 is divided by about μ; without this the interior-point method fails from μ = 1e3 on.

#include "tangible/math/scalar.h"

namespace tangible {

struct Equilibration {
  VectorX<double> row;  ///< R
  VectorX<double> col;  ///< C
};

/// Ruiz' iteration (alternating square roots of the largest entries). Rows and columns of zeros
/// keep the factor 1. Cost 10 passes over K.
Equilibration Equilibrate(const MatrixX<double>& K);

}  // namespace tangible
