// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rollouts as a differentiable function of torch tensors; the adjoint is the backward pass.
//
//   states = f(p, x₀, u)
//   (p̄, x̄₀, ū) = (∂f/∂(p, x₀, u))ᵀ f̄
//
// for each row of a batch; rollout_function.h defines the symbols. Both passes run the batch of
// lib/simulation on several threads, as the Python package does. All computations are in double
// precision on the CPU; input and output tensors may have any floating-point type. Results have the
// same bits for any number of threads.
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
  /// C paths of forces, torques and efforts that have a separate value in each step.
  std::vector<std::string> controls{};
  std::vector<long> records{};  ///< R ascending steps, 0 the start; empty: the end alone
  int threads = 0;              ///< 0: one a core
};

/// The inputs of a rollout. An undefined tensor stands for the values of the scene. A tensor
/// without the axis of the batch is the same in all N rows, and its derivative is the sum over
/// them.
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
  /// Returns an empty text, or one line as RolloutFunction::Create does.
  std::string Create(const Scene& scene, const RolloutLayerOptions& options);

  const RolloutFunction& function() const;

  /// Throws c10::Error where a shape is wrong, with the tensor, the expected and the given shape. A
  /// row that ends early does not stop the others. Its derivatives are NaN, or zero if its
  /// cotangent is zero (because the loss leaves the row out by torch::where or indexing).
  RolledOut operator()(const RolloutTensors& inputs) const;

 private:
  struct Shared;
  friend struct RolloutAutograd;
  std::shared_ptr<Shared> shared_;  ///< also of graphs that outlive the layer
};

}  // namespace tangible
