// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The adjoint of a rollout (reverse mode): from the derivatives of one or several losses with
// respect to states along the run to those with respect to all variables w = [initial poses |
// initial twists | numbers].
//
//   each step, backwards   x̄ = v̄⁺ + h q̄⁺,   Kᵀ u = x̄,   w̄ −= (∂R/∂w)ᵀ u      (local_jacobian.h)
//
// The forward run is recorded on a tape: per step the state, contacts, modes and impulses, and, if
// kept, the factorisation; otherwise it is recomputed on the way back.

#include <memory>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/simulation/rollout.h"

namespace tangible {

enum class Factorisations {
  kKeep,       ///< fastest; about ten times the memory of the states
  kRecompute,  ///< one assembly and factorisation more a step
};

class RolloutTape {
 public:
  /// Runs and records. The observer sees the states as Rollout's does.
  RolloutReport Record(const Model<double>& model, const State<double>& initial,
                       Factorisations factorisations, const StateObserver& observer,
                       State<double>* final);

  /// Adds to w_bar the derivatives of the losses with respect to the state after k steps; called
  /// from the last k to 0. Rows of poses and twists are those of that state.
  using Seed = std::function<void(long k, RowMatrixXd* w_bar)>;

  /// The reverse sweep: w_bar, num_variables x num_losses, gets the derivatives with respect to the
  /// initial poses, twists and the numbers. Chain with VariableJacobian(...)ᵀ w_bar for user
  /// parameters.
  void Adjoint(const Model<double>& model, int num_losses, const Seed& seed, RowMatrixXd* w_bar);
  /// The same from the state after `last` steps on, for losses that read no later one.
  void AdjointFrom(const Model<double>& model, long last, int num_losses, const Seed& seed,
                   RowMatrixXd* w_bar);

  /// Memory of the tape, bytes.
  size_t bytes() const;
  long steps() const { return static_cast<long>(used_); }

 private:
  struct Entry {
    StepRecord record;
    ContactSystem system;
    JointProjection projection;
    EventRecord events;  ///< event stepping: the step, in the place of all above
  };
  void StepAdjoint(const Model<double>& model, const StepRecord& record, ContactSystem* system,
                   JointProjection* projection, RowMatrixXd* w_bar);

  Factorisations factorisations_ = Factorisations::kKeep;
  std::vector<std::unique_ptr<Entry>> entries_;  ///< reused from run to run
  size_t used_ = 0;
  std::unique_ptr<Stepper> stepper_;
  const ModelStructure* structure_ = nullptr;
  ContactProblem<double> refactored_;  ///< memory of the problem that is assembled anew
  std::vector<double> u_;
  LocalJacobianScratch scratch_;
};

}  // namespace tangible
