// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a real body could have the mass, inertia and centre of mass that a scene gives it.
//
// A body of mass m whose matter lies within its shape, with the centre of mass at the frame's
// origin, has
//
//   0 < I <= m max Σ_i w_i |v_i|²     over w >= 0 with Σ w_i = 1, Σ w_i v_i = 0        (1)
//
// for |r|² is convex: the largest inertia is that of points on the shape's border, v_i its vertices
// (for a circle or capsule the whole border, whose farthest points lie opposite to each other). If
// no such w exists, the centre of mass is outside the shape. The largest Σ w_i |v_i|² of a polygon
// is a linear programme in the plane, whose solution has at most three vertices.
//
// Reference: P. M. Wensing, S. Kim and J.-J. E. Slotine, Linear matrix inequalities for physically
// consistent inertial parameter identification, IEEE Robotics and Automation Letters 3 (2018) 60.

#include <string>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

/// The largest I / m of matter within the shape that has its centre of mass at the origin, m²;
/// negative if the origin is outside. Infinite without a shape and for a half-plane.
double LargestSquaredGyration(const BasicShape<double>& shape);

/// One line for each moving body that cannot exist, e.g. "body 'arm' cannot exist: ..."; bodies
/// without a shape only need positive numbers, which a scene guarantees.
std::vector<std::string> FindInconsistentBodies(const Scene& scene);

}  // namespace tangible
