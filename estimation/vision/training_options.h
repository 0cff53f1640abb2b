// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The options of a training (model.h, training.h), apart from torch, whose headers take 20 s to
// compile.

#include <cstdint>

namespace tangible {

enum class DecoderKind { kLearned, kRenderer };

enum class DynamicsKind { kEngine, kPerceptron, kInteraction };
/// "engine", "mlp", "interaction".
const char* NameOf(DynamicsKind kind);

struct TrainingOptions {
  DynamicsKind dynamics = DynamicsKind::kEngine;
  DecoderKind decoder = DecoderKind::kLearned;
  double labels = 1.0;  ///< share of the sequences, from the first on, whose states are used
  bool physics_loss = true;
  bool self_consistency = false;     ///< L_self
  bool learns_parameters = true;     ///< the engine's, from wrong values
  bool starts_from_colours = false;  ///< the encoder (EncoderImpl::StartFromColours)
  int seen = 3;
  int ahead = 10;
  int batch = 32;
  long iterations = 1500;
  double learning_rate = 2e-3;  ///< falls to a fiftieth along half a cosine
  std::uint64_t seed = 0;
};

}  // namespace tangible
