// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The engine as a controlled system: a step of a scene, with forces, torques or efforts of joints
// that are constant over the step. A and B are the step's tangent; with event stepping they include
// the jumps at its events.
//
//   x   x, y, angle, vx, vy, omega of each moving body, as OutputNames orders them
//   u   the controls of a RolloutFunction

#include <map>
#include <memory>

#include "tangible/control/joint_state.h"
#include "tangible/control/step_map.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

class EngineStep : public StepMap {
 public:
  /// The function gives the scene and the controls' paths, and must outlive this object. Steps
  /// after its end have its dt.
  explicit EngineStep(const RolloutFunction& function);

  int num_states() const override { return function_.num_states(); }
  int num_controls() const override { return function_.num_controls(); }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override;
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override;
  /// The same only along `columns` (num_states x d): returns A columns, for an x that is a function
  /// of fewer coordinates.
  bool LineariseAlong(long k, const VectorX<double>& x, const VectorX<double>& u,
                      const MatrixX<double>& columns, VectorX<double>* next, MatrixX<double>* a,
                      MatrixX<double>* b, std::string* error);
  /// With event stepping: jumps of twists by more than the restitution threshold.
  const std::vector<int>& impacts() const override { return impacts_; }
  StepMap* Without(int impact) override;
  /// A step with all twists reversed. Damping is reversed too and restores the speed that it took;
  /// friction of contacts and joints is not reversed, and energy that an impact loses is not
  /// restored.
  bool StepBack(long k, const VectorX<double>& next, const VectorX<double>& u,
                VectorX<double>* x) override;

  /// Moves a state that was observed of another plant onto this scene's joints (joint_state.h).
  /// `error`: the joints' largest before, m or rad. One that cannot be moved there stays.
  JointState::Outcome ProjectOntoJoints(long k, VectorX<double>* x, double* error);

  /// To where changes of the state are projected there, to first order and with the joints' rows at
  /// x: num_states x num_states.
  MatrixX<double> JointProjector(long k, const VectorX<double>& x) const;

  /// Fixed steps from step `first` on, a row of `controls` each, from the states at their starts:
  /// the first contact that is made or broken, impact with restitution or slip that turns back,
  /// through which their derivatives are not the motion's (certificate/discrete_map.h). Empty where
  /// there is none, and with event stepping.
  std::string DiscreteMapOf(long first, const RowMatrixXd& states, const RowMatrixXd& controls);

  /// The initial state of the scene.
  VectorX<double> initial() const { return function_.Defaults().state; }
  /// The state of all bodies, including those of prescribed motion.
  State<double> StateOf(long k, const VectorX<double>& x) const;

 private:
  /// Sets the controls; false where they or the state are not finite.
  bool Set(long k, const VectorX<double>& x, const VectorX<double>& u, std::string* error);
  bool Advance(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
               std::string* error);
  void FindImpacts();

  /// Two bodies, or a joint whose limit was reached (−1: none).
  struct Meeting {
    int a, b, joint;
    auto operator<=>(const Meeting&) const = default;
  };
  struct Reduced;

  const RolloutFunction& function_;
  State<double> start_;
  Model<double> model_;
  Stepper stepper_;
  StepTangent tangent_;
  JointState joints_;
  RowMatrixXd controls_, w_dot_;             ///< of the variables: unit vectors of controls
  std::vector<std::vector<Meeting>> kinds_;  ///< of impacts: all that meet at once, ascending
  std::vector<int> impacts_;
  std::map<int, std::shared_ptr<Reduced>> without_;
};

}  // namespace tangible
