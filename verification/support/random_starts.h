// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random scenes that start in contact, near the limits of friction: rods and boxes on a corner,
// with friction below, at and above the coefficient beyond which a slip along that corner jams
// (Painlevé),
//
//   μ* = W_nn / |W_nt|,   W_nn = 1/m + r_x²/I,   W_nt = −r_x r_y / I,   r the contact's arm,
//
// boxes flat on a face, tall ones too; discs that slide, roll or rest; ladders between floor and
// wall; and each beside or under a second body. They slide either way or stick, turn or do not, and
// no contact approaches or opens.
//
// It has a separate generator (as in random_scene.h), so that RandomScene's scenes keep their bits.

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene.h"

namespace tangible {

Scene RandomStart(unsigned seed, Stepping stepping);

/// Parameters that open or close contacts or slide or turn the bodies of such a scene, and some of
/// the bodies' other parameters.
std::vector<ParameterPath> StartParameters(const Scene& scene);

}  // namespace tangible
