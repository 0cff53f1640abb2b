// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Quantities that characterise a motion: energy, momentum, gaps, groups of bodies.
//
//   kinetic     T = Σ ½ m (vx² + vy²) + ½ I ω²
//   potential   U = −Σ m g·x + Σ_springs ½ k (ℓ − L0)² + Σ_joints ½ k (coordinate − rest)²
//   momentum    (Σ m vx, Σ m vy, Σ m (x vy − y vx) + I ω), angular about the world's origin
//
// The sums include the bodies that move under forces. Joint drift is JointDrift of
// joint_projection.h.

#include <utility>
#include <vector>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// J.
double KineticEnergy(const Model<double>& model, const State<double>& state);
/// J, of gravity (0 at the origin) and springs.
double PotentialEnergy(const Model<double>& model, const State<double>& state);
/// N s, N s, N m s.
Vector3<double> Momentum(const Model<double>& model, const State<double>& state);

/// The depth of penetration of bodies that may collide: the largest −gap of all pairs, m; 0 where
/// no pair overlaps. Pairs that are apart contribute nothing, so that only those whose boxes meet
/// are examined: O(n log n) for n bodies that each touch a few.
double DeepestPenetration(const Model<double>& model, const State<double>& state);

/// Adds the pairs of bodies that a step's closed contacts and joint limits connect.
void AddClosedContacts(const StepRecord& record, std::vector<std::pair<int, int>>* pairs);

/// Groups of moving bodies that joints, springs, dampers and the closed contacts connect; a body by
/// itself is a group of one.
int CountIslands(const ModelStructure& structure, const std::pair<int, int>* closed,
                 size_t num_closed);

}  // namespace tangible
