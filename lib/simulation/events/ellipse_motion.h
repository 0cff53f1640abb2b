// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How long a motion may be where an ellipse touches.
//
// An ellipse with semi-axes a, b reaches h(φ) = √(a² cos² φ + b² sin² φ) in the direction φ of its
// frame. Where it touches, forces vary with φ as h does, whose power series about φ converges
// within the distance to the nearest zero, |φ − φ_0|: about h / a, the larger axis being a. That is
// b / a on the flat side, which a slender ellipse turns over within a small part of a step while
// the contact point runs from one tip to the other. Motions are so short that
//
//   |φ̇| τ + ½ |φ̈| τ² ≤ kEllipseTurn h / a,         τ² λn ρ / I ≤ kEllipsePhase²
//
// (the latter: the phase of the rocking of a body with moment of inertia I on which the normal
// force λn acts). To pass a flat side then takes 2 asinh(a / b) / kEllipseTurn motions: 416 where
// a / b = 333. With the radii of curvature ρ = a² b² / h³ of the shape and ρ' of the other one (∞:
// a face; 0: a corner), the angular velocities ω and ω', and the speed s of sliding along the
// tangent t, the direction of the contact turns in the ellipse by
//
//   φ̇ = (ρ' (ω − ω') + s) / (ρ + ρ'),   s = t·(v − v'),
//
// because the normal n keeps t·w = 0 (ellipse.h, (3)). φ̈ is the same of the accelerations.

#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The longest motion by the conditions above, and which contact sets it.
struct EllipseMotion {
  double longest = 0.0;  ///< s; infinite where no ellipse touches
  int contact = -1;
};

/// `accelerations`: those at the state, with the contacts' forces; open contacts do not count.
EllipseMotion LongestEllipseMotion(const Model<double>& model, const State<double>& state,
                                   const std::vector<ActiveContact>& contacts,
                                   const ContactSolution<double>& accelerations);

}  // namespace tangible
