// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Forces of joints and contacts in a solved problem, f(x, w), with their derivatives: x are the
// unknowns of the problem and w its variables (equation_jacobian.h).
//
//   joint     Σ rowᵀ y on bodies[0]: x and y in the world, and the torque about its anchor
//   contact   Σ λn, the normal force, and Σ λt, the tangential one on the first body along
//             t = (n_y, −n_x)
//
// The rows of a joint are its own, its limits, friction and motor, and those of couplings along its
// coordinate; a contact sums over the contact points of two bodies.
// Efforts, springs, dampers and servos of a joint are loads and no part of it. In a step they are
// impulses, N s and N m s.

#include <vector>

#include "tangible/dynamics/jacobian/equation_jacobian.h"

namespace tangible {

struct ConstraintForce {
  enum class Component : unsigned char { kX, kY, kTorque, kNormal, kTangent };
  Component component = Component::kX;
  int joint = -1;  ///< −1: of a contact
  int a = -1, b = -1;
};

/// The value of a force. Where `by_unknowns` is given, ∂f/∂x is added to it, three numbers for each
/// block of the system, and ∂f/∂w at fixed x is appended to `by_variables`, of row 0.
double EvaluateForce(const Model<double>& model, const SolvedEquations& solved,
                     const ConstraintForce& force, LocalJacobianScratch* scratch,
                     double* by_unknowns, std::vector<JacobianEntry>* by_variables);

}  // namespace tangible
