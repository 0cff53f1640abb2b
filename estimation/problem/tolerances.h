// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the problem of a fit. Each comment names the quantity of which the tolerance is
// a fraction or multiple, then the reason. The README has the table.

namespace tangible {

/// Of a step: times that differ by less are the same, because decimal times miss a step by
/// rounding.
inline constexpr double kTimeTolerance = 1e-9;
/// Of a step: half the time over which an acceleration is averaged in event stepping; steps end at
/// both ends of that time.
inline constexpr double kRateStep = 1e-3;
/// Of the duration: how much longer a run may be where clocks or delays are estimated, because the
/// last observations may be of a later time.
inline constexpr double kRunsOn = 0.1;
/// Of 1, a component of a direction: what is smaller is the rounding of a link along an axis.
inline constexpr double kLinkDirection = 1e-12;
/// Of the length of a link: a point of its body that is nearer to its end moves with it.
inline constexpr double kLinkEnd = 1e-6;
/// Of the parameter, at least its scale: a parameter that differs from a bound by less is at the
/// bound, because exp(ln bound) and the projection of the minimiser reach a bound within this
/// error.
inline constexpr double kBoundRounding = 1e-13;
/// Of the initial value: a logarithmic parameter whose lower bound is 0 becomes no smaller, and is
/// then at that bound. A parameter that the observations determine is not started ten decades from
/// its value, and a body of so small an inertia is still larger than the rounding of its place.
inline constexpr double kVanished = 1e-10;
/// Of the observed value: the rounding of a run and the errors that its projections leave; smaller
/// residuals carry no information.
inline constexpr double kPredictionRounding = 1e-9;
/// Of the largest inertia, or the area of a triangle: a thin ring, or two points at the ends, have
/// exactly the largest inertia, and rounding must not count as a violation.
inline constexpr double kInertiaRounding = 1e-9;
/// Of the norm of all innovations, whose deviation is 1: a step of the random forces that is
/// shorter changes no estimate by a visible part of its deviation, and the cost by its square.
inline constexpr double kSmoothedForces = 1e-6;
/// Of the cost with random forces: rounding of its sum.
inline constexpr double kEqualNoiseCost = 1e-12;
/// Of the distance of knots: one of n steps is not n − 1 steps by rounding.
inline constexpr double kKnotRounding = 1e-9;

}  // namespace tangible
