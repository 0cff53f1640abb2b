// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Projection of poses onto the joints: after q̃ = q + h v⁺ finds the nearest q⁺ with C(q⁺) = 0, in
// the metric of M,
//
//   M (q⁺ − q̃) = A(q⁺)ᵀ μ,   C(q⁺) = 0,   A = ∂C/∂q
//
// The directions A(q⁺) are those at the solution, not at q̃: with directions frozen at q̃ there is
// no solution where the drift is large. The derivative uses the matrix of the last iterate of
// projection_newton.h.

#include <vector>

#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/simulation/stepping/projection_newton.h"

namespace tangible {

/// Whether steps of the model project poses onto joints.
inline bool ProjectsOntoJoints(const ModelStructure& structure) {
  return JointCorrectionOf(structure.settings) == JointCorrection::kProjection &&
         !structure.joints.empty();
}

class JointProjection {
 public:
  /// Projects the poses of the state; false (with the state's last iterate) where the tolerance is
  /// not met. `start`: poses near the joints, those before the step, from which a minimum is sought
  /// where Newton's method does not converge.
  bool Project(const Model<double>& model, const std::vector<double>& start, State<double>* state);
  /// Largest |C| after the last projection, m or rad.
  double error() const { return iterate_.error; }
  /// How many of its steps were not Newton steps.
  int damped_steps() const { return iterate_.damped_steps; }
  /// The joint with that error; −1 without joints.
  int worst_joint() const;

  /// Tangent at the last projection: w_dot (poses of q̃, twists, numbers) has its poses of moving
  /// bodies replaced by those of q⁺. Row-major, `columns` columns.
  void Tangent(const Model<double>& model, double* w_dot, int columns);
  /// Adjoint: w_bar's poses of moving bodies are those of q⁺ on entry, of q̃ on return; the other
  /// entries are added to.
  void Adjoint(const Model<double>& model, double* w_bar, int columns);

  /// The unrolled iteration in Jets: the same steps in T, and more until derivatives, which lag
  /// behind values, have converged.
  template <typename T>
  static void ProjectUnrolled(const Model<T>& model, const std::vector<double>& start,
                              State<T>* state);

  void Reserve(int num_blocks, int num_edges) { iterate_.lu.Reserve(num_blocks, num_edges); }
  /// Memory of the last projection, bytes.
  size_t bytes() const;

 private:
  template <typename Sink>
  void Visit(const Model<double>& model, const Sink& sink);
  template <typename Sink>
  void VisitShare(const Model<double>& model, int j, int k, const Sink& sink);
  void SolveRefined(const Model<double>& model, std::vector<double>* x, int columns);

  ProjectionIterate<double> iterate_;
  std::vector<double> rhs_, solution_;
};

/// Largest |C(q)| over all joints: m for anchors, rad for angles; 0 without joints.
double JointDrift(const Model<double>& model, const State<double>& state);

}  // namespace tangible
