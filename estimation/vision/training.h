// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Training of encoder, dynamics and decoder on sequences of which the first few have labels.
//
// * With labels: L_enc = |estimated − true state|², L_phys = |dynamics(true state) − true states
//   ahead| (Huber's loss), and L_dec = |decoded − true picture|² of the true positions.
// * Without: L_dec of the positions seen, and of those that the dynamics give from the estimated
//   state. If asked, L_self = |dynamics(estimated state) − positions seen later|.
//
// The windows of a step follow from the seed and the number of the step only, so that a training
// that was interrupted ends with the same bits on one thread.

#include <memory>
#include <string>

#include "tangible/estimation/vision/disc_data.h"
#include "tangible/estimation/vision/model.h"
#include "tangible/estimation/vision/training_options.h"

namespace tangible {

struct TrainingLoss {
  double total = 0.0, encoder = 0.0, physics = 0.0, decoder = 0.0, self = 0.0;
};

class Trainer {
 public:
  /// The data must outlive the trainer.
  Trainer(const DiscData& data, const TrainingOptions& options);
  ~Trainer();

  /// Runs one iteration.
  TrainingLoss Step();
  long iteration() const { return iteration_; }

  /// Everything on which the next steps depend, as the bytes of a file, and the reverse, which
  /// returns false, with one line, where they are damaged or belong to another training.
  std::string Save();
  bool Load(const std::string& bytes, const std::string& name_for_messages, std::string* error);

  const TrainingOptions& options() const { return options_; }
  Encoder& encoder() { return encoder_; }
  Decoder& decoder() { return decoder_; }
  Dynamics& dynamics() { return dynamics_; }

 private:
  struct Batch;
  Batch Draw() const;
  TrainingLoss Loss(const Batch& batch, at::Tensor* total);
  std::string Fingerprint() const;
  /// Both return what is wrong, or empty.
  std::string LoadWeights(const std::string& weights);
  std::string WrongMoments() const;

  const DiscData& data_;
  TrainingOptions options_;
  long iteration_ = 0;
  Encoder encoder_{nullptr};
  Decoder decoder_{nullptr};
  Dynamics dynamics_{nullptr};
  std::unique_ptr<torch::optim::Adam> adam_;
};

/// Pictures (count, 3, 64, 64) in [0, 1] of frames of sequences.
at::Tensor PicturesOf(const DiscData& data, const std::vector<std::pair<int, int>>& frames);

/// States (count, n, 4).
at::Tensor StatesOf(const DiscData& data, const std::vector<std::pair<int, int>>& frames);

}  // namespace tangible
