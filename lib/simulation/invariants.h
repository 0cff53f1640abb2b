// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a motion should keep: energy, momentum, gaps, groups of bodies.
//
//   kinetic     T = Σ ½ m (vx² + vy²) + ½ I ω²
//   potential   U = −Σ m g·x + Σ_springs ½ k (ℓ − L0)²
//   momentum    (Σ m vx, Σ m vy, Σ m (x vy − y vx) + I ω), angular about the world's origin
//
// Sums over the bodies that move by forces. Joint drift is JointDrift of joint_projection.h.

#include "tangible/simulation/step.h"

namespace tangible {

/// J.
double KineticEnergy(const Model<double>& model, const State<double>& state);
/// J, of gravity (0 at the origin) and springs.
double PotentialEnergy(const Model<double>& model, const State<double>& state);
/// N s, N s, N m s.
Vector3<double> Momentum(const Model<double>& model, const State<double>& state);

/// The smallest gap (m, negative in penetration) over all pairs of bodies that may collide;
/// infinite if there are none. Looks at every pair: quadratic in the number of bodies.
double SmallestGap(const Model<double>& model, const State<double>& state);

/// Groups of moving bodies that the step's joints, springs, dampers and closed contacts connect; a
/// body by itself is a group of one.
int CountIslands(const ModelStructure& structure, const StepRecord& record);

}  // namespace tangible
