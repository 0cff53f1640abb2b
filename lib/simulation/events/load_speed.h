// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The speed to which the loads of a step accelerate bodies in a time step, besides gravity: the
// scale of the rounding of speeds where gravity is small or 0.

#include "tangible/dynamics/model/lengths.h"
#include "tangible/dynamics/model/model.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The largest over bodies of dt |F| / m and dt |τ| r / (I + m r²), m/s, of the forces and efforts
/// that act within [t, t + h], the springs at `state`, and the friction of joints at its limit; r
/// is the body's size.
double LoadSpeed(const Model<double>& model, const Lengths& lengths, double t, double h,
                 const State<double>& state);

/// The largest acceleration that loads alone give a body, m/s², of points at the distance of its
/// radius of gyration.
double LoadAcceleration(const ContactProblem<double>& problem);

/// The largest acceleration (m/s² or rad/s²) that friction of joints at its limit gives by itself,
/// of a problem of accelerations.
double LimitAcceleration(const ContactProblem<double>& problem);

}  // namespace tangible
