// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Projection of poses onto the joints: after q̃ = q + h v⁺ finds q⁺ near q̃ with C(q⁺) = 0,
//
//   M (q⁺ − q̃) = A(q̃)ᵀ μ,   C(q⁺) = 0,
//
// the correction along the joints' directions at q̃ that is least in the metric of M to first order.
// Newton's method with the matrix [M −A(q̃)ᵀ; A(q) 0]; at the end the matrix with A(q⁺) is the
// derivative's.

#include <string>
#include <vector>

#include "tangible/dynamics/local_jacobian.h"
#include "tangible/lcp/block_lu.h"

namespace tangible {

class JointProjection {
 public:
  /// Projects the poses of the state; false (with the state's last iterate) where the tolerance is
  /// not met.
  bool Project(const Model<double>& model, State<double>* state);
  /// Largest |C| after the last projection, m or rad.
  double error() const { return error_; }

  /// Tangent at the last projection: w_dot (poses of q̃, twists, numbers) has its poses of moving
  /// bodies replaced by those of q⁺. Row-major, `columns` columns.
  void Tangent(const Model<double>& model, double* w_dot, int columns);
  /// Adjoint: w_bar's poses of moving bodies are those of q⁺ on entry, of q̃ on return; the rest is
  /// added to.
  void Adjoint(const Model<double>& model, double* w_bar, int columns);

  /// The unrolled iteration in Jets: Newton steps in T until values and one more step have
  /// converged.
  template <typename T>
  static void ProjectUnrolled(const Model<T>& model, State<T>* state);

  void Reserve(int num_blocks, int num_edges) { lu_.Reserve(num_blocks, num_edges); }

 private:
  void Factor(const Model<double>& model);
  template <typename Sink>
  void Visit(const Model<double>& model, const Sink& sink);

  State<double> from_, to_;          ///< q̃ and q⁺
  std::vector<double> multipliers_;  ///< μ, three a joint
  std::vector<JointRows<double>> rows_from_, rows_to_;
  BlockLu<double> lu_;
  std::vector<std::pair<int, int>> edges_;
  std::vector<double> rhs_;
  double error_ = 0.0;
};

/// Largest |C(q)| over all joints: m for anchors, rad for angles; 0 without joints.
double JointDrift(const Model<double>& model, const State<double>& state);

}  // namespace tangible
