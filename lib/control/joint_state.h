// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A state that was observed of a plant does not lie on the joints of a model whose lengths are
// others: where the pole of the plant is longer its centre is not where the model's hinge holds it,
// and no step can be made from there. The nearest state on the joints is taken in its place,
//
//   min |q − q̃|²_W,  C(q) = 0;        min |v − ṽ|²_W,  A(q) v = 0,   A = ∂C/∂q
//
// with W = M but for inertias, which weigh kTurnWeight times as much: lengths that differ shift
// bodies, and angles and rates stay as they were observed where the joints leave them free.

#include "tangible/dynamics/model/model.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/stepping/joint_projection.h"

namespace tangible {

class JointState {
 public:
  explicit JointState(const Model<double>& model);

  enum class Outcome {
    kOnJoints,   ///< the joints' errors are within kOffJoints: nothing is changed
    kProjected,  ///< the poses and twists of moving bodies are
    kFailed,     ///< no poses were found that satisfy the joints
  };
  Outcome Project(State<double>* state);

  /// To where changes of poses or twists of moving bodies, a block each, are projected:
  /// I − W^-½ (A W^-½)⁺ A, 3 num_moving x 3 num_moving.
  MatrixX<double> Projector(const State<double>& state) const;

  /// The joints' largest error before the last projection, m or rad.
  double error() const { return error_; }

 private:
  struct Rows {
    MatrixX<double> rows;   ///< A W^-½
    VectorX<double> rates;  ///< A v
    VectorX<double> roots;  ///< the diagonal of W^½
  };
  Rows RowsAt(const State<double>& state) const;
  /// Dense: cubic in the number of rows of joints.
  void ProjectTwists(State<double>* state) const;

  Model<double> model_;  ///< with heavier turns
  JointProjection projection_;
  double error_ = 0.0;
};

}  // namespace tangible
