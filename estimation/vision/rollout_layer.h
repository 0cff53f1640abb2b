// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rollouts as a differentiable function of torch tensors; the adjoint is the backward pass.
//
//   states = f(p, x₀, u)
//   (p̄, x̄₀, ū) = (∂f/∂(p, x₀, u))ᵀ f̄
//
// for each row of a batch; rollout_function.h defines the symbols. Both passes run the batch of
// lib/simulation on several threads, the same that the Python package runs. Inside everything is
// computed in double precision on the CPU; outside tensors are of any type of floating-point
// numbers. Results have the same bits for any number of threads.
//
// Where two-sided derivatives do not exist (a grazing contact), backward takes one element of the
// generalised Jacobian; RolloutBatch::Certify of `function()` says where. Second derivatives are
// refused.

#include <torch/types.h>

#include <memory>
#include <string>
#include <vector>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

struct RolloutLayerOptions {
  std::vector<std::string> parameters{};  ///< P paths into the scene
  /// C paths of forces, torques and efforts that have a value of their own in each step.
  std::vector<std::string> controls{};
  std::vector<long> records{};  ///< R ascending steps, 0 the start; empty: the end alone
  int threads = 0;              ///< 0: one a core
};

/// What tensors are rolled out from. One that is undefined stands for the scene's own values; one
/// without the batch's axis is the same in all N rows, and its derivative is the sum over them.
struct RolloutTensors {
  at::Tensor parameters{};  ///< (P) or (N, P), SI units
  at::Tensor state{};       ///< (S) or (N, S): x, y, angle, vx, vy, omega of each moving body
  at::Tensor controls{};    ///< (steps, C) or (N, steps, C), N or N m
};

struct RolledOut {
  /// (R, S), or (N, R, S) of a batch; of the type and on the device of the first tensor given
  /// (double where none is). States that a row did not reach are NaN.
  at::Tensor states;
  std::vector<std::string> messages;  ///< a row: empty, or why it ended early
};

class RolloutLayer {
 public:
  /// Returns empty or one line, as RolloutFunction::Create.
  std::string Create(const Scene& scene, const RolloutLayerOptions& options);

  const RolloutFunction& function() const;

  /// Throws c10::Error where a shape is wrong: which, expected, got. A row that ended early stops
  /// no other. Its derivatives are NaN, unless its cotangent is zero (a loss that leaves the row
  /// out by torch::where or indexing): then they are zero.
  RolledOut operator()(const RolloutTensors& inputs) const;

 private:
  struct Shared;
  friend struct RolloutAutograd;
  std::shared_ptr<Shared> shared_;  ///< also of graphs that outlive the layer
};

}  // namespace tangible
