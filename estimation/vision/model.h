// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Encoder, dynamics and decoder: from a few pictures of discs to their states, to states ahead, and
// back to pictures. Sizes: B rows of a batch, K frames seen, F frames ahead, n discs; positions are
// in pixels, velocities in pixels a frame.
//
// The encoder looks twice. Two convolutions of the picture at half its size give each of its pixels
// a weight w ≥ 0 for each disc, and the centre of the weights, Σ w r / Σ w, is the position of the
// disc. A network whose input are the pixels around it corrects that position to hundredths of a
// pixel. The velocity is the last difference of positions and a correction by a network that sees
// all discs' positions in the window.
//
// The dynamics are the engine (rollout_layer.h) with its physical parameters, or a multilayer
// perceptron of the states of all discs, or an interaction network (Battaglia et al. 2016), in
// which the sum of the effects of pairs and the disc's own state give its change.
//
// The decoder's picture is cloth + Σ share(|r − xᵢ|) (colourᵢ − cloth). The share is a network of
// the distance to the disc's centre, and colours are learned; alternatively the decoder is the
// known renderer.

#include <torch/torch.h>

#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/vision/disc_world.h"
#include "tangible/estimation/vision/rollout_layer.h"
#include "tangible/estimation/vision/training_options.h"

namespace tangible {

class EncoderImpl : public torch::nn::Module {
 public:
  EncoderImpl(const DiscWorld& world, int frames);
  /// Sets the weights by the known colours instead of at random, which gives positions without any
  /// label.
  void StartFromColours(const DiscWorld& world);
  /// The first look, from (N, 3, 64, 64) in [0, 1] to centres (N, n, 2).
  at::Tensor Centres(const at::Tensor& pictures);
  /// The second look, which corrects these centres.
  at::Tensor Refine(const at::Tensor& pictures, const at::Tensor& centres);
  /// Both looks.
  at::Tensor Positions(const at::Tensor& pictures) { return Refine(pictures, Centres(pictures)); }
  /// From positions (B, K, n, 2) to states (B, n, 4) at the last frame.
  at::Tensor State(const at::Tensor& positions);

 private:
  int discs_;
  int64_t patch_;  ///< pixels that the second look sees, each way
  torch::nn::Conv2d first_{nullptr}, second_{nullptr};
  torch::nn::Sequential correction_{nullptr}, velocity_{nullptr};
};
TORCH_MODULE(Encoder);

class DecoderImpl : public torch::nn::Module {
 public:
  DecoderImpl(const DiscWorld& world, DecoderKind kind);
  /// From centres (N, n, 2) to pictures (N, 3, 64, 64).
  at::Tensor forward(const at::Tensor& positions);

 private:
  at::Tensor Share(const at::Tensor& distance);
  DecoderKind kind_;
  DiscStyle style_;
  double radius_;
  int64_t patch_;  ///< pixels that a disc is drawn on, each way
  at::Tensor cloth_, colours_;
  torch::nn::Sequential share_{nullptr};
};
TORCH_MODULE(Decoder);

/// Predicted states, and the rows that the engine could run.
struct Ahead {
  at::Tensor states;  ///< (B, F, n, 4), without the start; 0 in rows that were not run
  at::Tensor valid;   ///< (B), 1 or 0
};

struct DynamicsOptions {
  DynamicsKind kind = DynamicsKind::kEngine;
  int frames = 10;  ///< F
  /// Whether the engine's masses (that of the first disc is 1), restitutions and damping are
  /// learned, from wrong values; otherwise they are those of the world.
  bool learns_parameters = false;
  int threads = 1;  ///< of the engine
};

class DynamicsImpl : public torch::nn::Module {
 public:
  DynamicsImpl(const DiscWorld& world, const DynamicsOptions& options);
  /// Predicts from states (B, n, 4).
  Ahead forward(const at::Tensor& state);
  /// Names and values of the physical parameters that are learned.
  const std::vector<std::string>& parameter_names() const { return names_; }
  at::Tensor PhysicalParameters() const;
  /// Moves restitutions back into [0, 1] after a step of the optimiser.
  void Project();

 private:
  Ahead ByEngine(const at::Tensor& state);
  at::Tensor OneFrame(const at::Tensor& state);

  DynamicsOptions options_;
  int discs_;
  std::vector<std::string> names_;
  RolloutLayer layer_;
  at::Tensor log_masses_, restitutions_, log_damping_;
  torch::nn::Sequential pair_{nullptr}, disc_{nullptr};
};
TORCH_MODULE(Dynamics);

}  // namespace tangible
