// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The engine as a system to control: a step of a scene, with forces, torques or efforts of joints
// that are held over it. A and B are the step's tangent; with event stepping they hold the jumps of
// its events.
//
//   x   x, y, angle, vx, vy, omega of each moving body, as OutputNames orders them
//   u   the controls of a RolloutFunction

#include "tangible/control/step_map.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

class EngineStep : public StepMap {
 public:
  /// The function gives the scene and the controls' paths, and outlives this. Steps beyond its end
  /// have its dt.
  explicit EngineStep(const RolloutFunction& function);

  int num_states() const override { return function_.num_states(); }
  int num_controls() const override { return function_.num_controls(); }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override;
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override;
  /// The same along `columns` (num_states x d) alone: A columns, as where x is a function of fewer
  /// coordinates.
  bool LineariseAlong(long k, const VectorX<double>& x, const VectorX<double>& u,
                      const MatrixX<double>& columns, VectorX<double>* next, MatrixX<double>* a,
                      MatrixX<double>* b, std::string* error);

  /// The scene's own.
  VectorX<double> initial() const { return function_.Defaults().state; }
  /// The whole state, of bodies that move by themselves too.
  State<double> StateOf(long k, const VectorX<double>& x) const;

 private:
  bool Advance(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
               std::string* error);

  const RolloutFunction& function_;
  State<double> start_;
  Model<double> model_;
  Stepper stepper_;
  StepTangent tangent_;
  RowMatrixXd controls_, w_dot_;  ///< of the variables: unit vectors of controls
};

}  // namespace tangible
