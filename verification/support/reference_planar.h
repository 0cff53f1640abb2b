// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Motions in the plane that are known exactly, as those of reference_motion.h: in continuous time a
// box without weight whose corner strikes a wall, by Newton's law or by Poisson's two phases; and
// also of fixed steps a disc that slides off the end of a face.

#include "tangible/scene/scene.h"
#include "tangible/verification/support/reference_motion.h"

namespace tangible {

struct PlanarMotion {
  Coordinate x, y, turn;
};

/// A box before a wall whose face at x = `face` looks along −x.
struct StruckBox {
  Real half_width = 0.1L, half_height = 0.1L;  ///< m
  Real mass = 1.0L, inertia = 1.0L;
  Real face = 0.0L;
  Real friction = 0.0L;
  Surface surface;
  ImpactLaw law = ImpactLaw::kNewton;
};

/// The motion of a box one of whose corners strikes the wall once. `clearance`: the least distance
/// of a corner from the wall after the impact, but for the first tenth of what is left of the run;
/// if it is not positive a second impact follows, and the motion is not this one.
PlanarMotion StrikeWall(PlanarMotion start, const StruckBox& box, Real duration,
                        Real* clearance = nullptr);

/// A disc without friction on a level face, which ends at along = `edge`; `above` is its centre's
/// height over the face. It slides with along' > 0 fast enough to leave the edge at once:
/// along'² ≥ g radius.
PlanarMotion SlideOffFace(Coordinate along, Coordinate above, Real radius, Real edge, Real gravity,
                          const Surface& surface, const Course& course);

}  // namespace tangible
