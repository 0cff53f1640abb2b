// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random scenes that start in contact, at the edge of what contacts can do: rods and boxes on a
// corner, with friction below, at and above the coefficient beyond which a slip along that corner
// jams (Painlevé),
//
//   μ* = W_nn / |W_nt|,   W_nn = 1/m + r_x²/I,   W_nt = −r_x r_y / I,   r the contact's arm,
//
// boxes flat on a face, tall ones too; discs that slide, roll or rest; ladders between floor and
// wall; and each beside or under a second body. They slide either way or stick, turn or do not, and
// no contact approaches or opens.
//
// A generator of its own (as in random_scene.h), so that RandomScene's scenes keep their bits.

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene.h"

namespace tangible {

Scene RandomStart(unsigned seed, Stepping stepping);

/// What opens, closes, slides or turns the bodies of such a scene, and some of their numbers.
std::vector<ParameterPath> StartParameters(const Scene& scene);

}  // namespace tangible
