// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Forces of joints and contacts in a step, f(w), with their derivatives by the variables w of a
// state (force_gradient.h).
//
//   fixed steps   the impulse of the step over its length; w before the step, Kᵀ u = ∂f/∂x:
//                 ∂f/∂w|x − (∂R/∂w)ᵀ u
//   by events     the force at the end of the step, with the modes of its last motion; w there. Of
//                 the run's first step also that at its start, with the modes of its first motion.
//
// At an event the force by events is that of the motion before it, and an impact has none.

#include <vector>

#include "tangible/dynamics/jacobian/force_gradient.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

enum class ForceInstant : unsigned char { kStart, kEnd };

struct StepForce {
  double value = 0.0;                       ///< N or N m
  std::vector<JacobianEntry> by_variables;  /// of row 0, with an entry for each variable at most
};

class StepForces {
 public:
  /// Evaluates forces in the step that the stepper has just done; the instant matters by events
  /// alone. A force that cannot be determined is not a number.
  void Evaluate(const Model<double>& model, const std::vector<ConstraintForce>& forces,
                ForceInstant instant, Stepper* stepper, std::vector<StepForce>* out);

 private:
  void OfFixedStep(const Model<double>& model, const std::vector<ConstraintForce>& forces,
                   Stepper* stepper, std::vector<StepForce>* out);
  /// Of those forces that act within an island.
  void OfIsland(const Model<double>& whole, const std::vector<ConstraintForce>& forces,
                ForceInstant instant, double h, const IslandRecord& island,
                std::vector<StepForce>* out);
  void SeedForces(const Model<double>& model, const SolvedEquations& solved,
                  const std::vector<ConstraintForce>& forces, int blocks, RowMatrixXd* seeds,
                  RowMatrixXd* w_bar, std::vector<double>* values);

  SolveDerivative solve_;
  LocalJacobianScratch scratch_;
};

}  // namespace tangible
