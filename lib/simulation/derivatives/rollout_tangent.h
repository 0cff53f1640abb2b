// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tangent of a rollout (forward mode): derivatives of the state with respect to any directions
// in the variables w = [initial poses | initial twists | parameters].
//
//   each step   K ẋ = −(∂R/∂w) ẇ   (equation_jacobian.h),   q̇⁺ = q̇ + h v̇⁺
//
// with the factorisation that the step's solve ended with, for all directions at once.

#include "tangible/math/scalar.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

/// w_dot: num_variables x num_directions; rows of poses and twists are those of the current state.
using TangentObserver =
    std::function<void(long k, double t, const State<double>& state, const RowMatrixXd& w_dot)>;

/// Sets the rows of the controls' parameters to the directions of their values in step k.
using ControlDirections = std::function<void(long k, RowMatrixXd* w_dot)>;

/// Runs the rollout with its tangent. `w_dot` holds the directions on entry (VariableJacobian of
/// parameter_map.h, dense) and the final state's derivatives on return, when the rows of controls'
/// parameters are those of the last step.
RolloutReport RolloutTangent(ControlledModel<double> model, const State<double>& initial,
                             const ControlDirections& directions, const TangentObserver& observer,
                             Stepper* stepper, RowMatrixXd* w_dot, State<double>* final,
                             const StepRange& range = {});
/// The same without controls, with a stepper of its own.
RolloutReport RolloutTangent(const Model<double>& model, const State<double>& initial,
                             const TangentObserver& observer, RowMatrixXd* w_dot,
                             State<double>* final);

/// The speeds that the columns of directions drive in the steps of a rollout. What is left of a
/// direction that the first steps have absorbed is rounding, in which nothing can be recognised.
class DrivenSpeeds {
 public:
  /// The largest speed that a column drives in a step; 0 where it is rounding of what the column
  /// drove before. `rhs` points to its first number of `rows`, which lie `stride` apart: momenta of
  /// bodies, then speeds of constraints.
  double Of(int column, const ContactProblem<double>& problem, const double* rhs, int rows,
            int stride);

 private:
  std::vector<double> most_;
};

/// The tangent of the step that the stepper has just done.
class StepTangent {
 public:
  /// For all further steps from `w_dot` on, made with this object alone: numbers of the model that
  /// no column varies are left out of the derivatives of fixed steps. Returns how many they are.
  int FixNumbers(const ModelStructure& structure, const RowMatrixXd& w_dot);
  /// Reverts this for some numbers.
  void Vary(const ModelStructure& structure, const std::vector<int>& numbers);
  /// Returns the largest relative residual of the linear solve.
  double Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot);
  /// The same; it also measures how far the derivatives of the contacts' impulses exceed the speeds
  /// that the perturbation drives: the largest over columns of |λ̇| mobility / max(|ṗ| / m, |ċ|,
  /// |v̇|). The usual values are 1 to 1e3; above 1e6 the perturbation contradicts redundant rows
  /// (it breaks one contact and not the other), and no derivative exists.
  double ApplyAndMeasure(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot);

 private:
  DrivenSpeeds driven_;
  std::vector<char> fixed_;  ///< 1: no column varies the variable; empty: unknown
};

}  // namespace tangible
