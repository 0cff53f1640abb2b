// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/evaluation.h"

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

constexpr int kRows = 50;  // windows or pictures at a time

using Frames = std::vector<std::pair<int, int>>;

at::Tensor Estimate(Trainer* trainer, const DiscData& data, const Frames& starts) {
  const int seen = trainer->options().seen;
  Frames frames;
  for (const auto& [sequence, first] : starts) {
    for (int k = 0; k < seen; ++k) frames.emplace_back(sequence, first + k);
  }
  const auto rows = static_cast<int64_t>(starts.size());
  const at::Tensor positions = trainer->encoder()->Positions(PicturesOf(data, frames));
  return trainer->encoder()->State(positions.reshape({rows, seen, data.world.size(), 2}));
}

// Positions (B, F, n, 2) that are predicted for windows, and which of them could be run.
Ahead Predict(Trainer* trainer, Dynamics* truth, const DiscData& data, Predictor predictor,
              const Frames& starts) {
  const int frames = trainer->options().ahead;
  if (predictor == Predictor::kTruth) {
    Frames last = starts;
    for (auto& [sequence, frame] : last) frame += trainer->options().seen - 1;
    return (*truth)(StatesOf(data, last));
  }
  const at::Tensor state = Estimate(trainer, data, starts);
  Ahead ahead = trainer->dynamics()(state);
  std::vector<at::Tensor> straight;
  const double moves = predictor == Predictor::kLastFrame ? 0.0 : 1.0;
  for (int k = 1; k <= frames; ++k) {
    straight.push_back(torch::cat(
        {state.slice(2, 0, 2) + moves * k * state.slice(2, 2, 4), state.slice(2, 2, 4)}, 2));
  }
  const at::Tensor instead = torch::stack(straight, 1);
  if (predictor != Predictor::kModel) return {instead, torch::ones_like(ahead.valid)};
  const int64_t rows = state.size(0);
  ahead.states = torch::where(ahead.valid.reshape({rows, 1, 1, 1}) > 0.5, ahead.states,
                              state.unsqueeze(1).expand_as(ahead.states));
  return ahead;
}

std::string BytesOf(const at::Tensor& picture) {
  const at::Tensor bytes =
      (torch::clamp(picture, 0.0, 1.0) * 255.0).round().to(torch::kByte).contiguous();
  return {reinterpret_cast<const char*>(bytes.data_ptr<uint8_t>()), kPictureBytes};
}

}  // namespace

const char* NameOf(Predictor predictor) {
  switch (predictor) {
    case Predictor::kModel:
      return "model";
    case Predictor::kConstantVelocity:
      return "constant velocity";
    case Predictor::kLastFrame:
      return "last frame";
    case Predictor::kTruth:
      return "true state";
  }
  return "";
}

HorizonErrors Evaluate(Trainer* trainer, const DiscData& data, Predictor predictor, int stride) {
  const torch::NoGradGuard guard;
  const int seen = trainer->options().seen, ahead = trainer->options().ahead;
  Dynamics truth(data.world, DynamicsOptions{.frames = ahead});
  Frames starts;
  for (int s = 0; s < data.num_sequences(); ++s) {
    for (int first = 0; first + seen + ahead <= data.frames; first += stride) {
      starts.emplace_back(s, first);
    }
  }
  HorizonErrors errors;
  errors.position.assign(ahead, 0.0);
  errors.picture.assign(ahead, 0.0);
  errors.windows = static_cast<long>(starts.size());
  std::vector<at::Tensor> all;
  for (size_t at = 0; at < starts.size(); at += kRows) {
    const Frames part(
        starts.begin() + static_cast<std::ptrdiff_t>(at),
        starts.begin() + static_cast<std::ptrdiff_t>(std::min(starts.size(), at + kRows)));
    const auto rows = static_cast<int64_t>(part.size());
    const Ahead predicted = Predict(trainer, &truth, data, predictor, part);
    errors.unsolved += rows - predicted.valid.sum().item<int64_t>();
    std::vector<at::Tensor> squares;
    for (int k = 0; k < ahead; ++k) {
      Frames frames = part;
      for (auto& [sequence, frame] : frames) frame += seen + k;
      const at::Tensor positions = predicted.states.select(1, k).slice(2, 0, 2);
      const at::Tensor off = positions - StatesOf(data, frames).slice(2, 0, 2);
      squares.push_back(off.square().sum(2).mean(1));
      errors.position[k] += squares.back().sum().item<double>();
      const at::Tensor pictures = trainer->decoder()(positions) - PicturesOf(data, frames);
      errors.picture[k] += pictures.square().mean({1, 2, 3}).sum().item<double>();
    }
    all.push_back(torch::stack(squares, 1));
  }
  const at::Tensor medians = std::get<0>(torch::cat(all).median(0));
  for (int k = 0; k < ahead; ++k) {
    errors.position[k] /= static_cast<double>(errors.windows);
    errors.picture[k] /= static_cast<double>(errors.windows);
    errors.position_median.push_back(medians[k].item<double>());
  }
  return errors;
}

std::vector<double> SeePositions(Trainer* trainer, const DiscData& data,
                                 const std::function<void(int sequence)>& progress) {
  const torch::NoGradGuard guard;
  std::vector<double> positions;
  for (int s = 0; s < data.num_sequences(); ++s) {
    for (int first = 0; first < data.frames; first += kRows) {
      Frames frames;
      for (int k = first; k < std::min(data.frames, first + kRows); ++k) frames.emplace_back(s, k);
      const at::Tensor seen =
          trainer->encoder()->Positions(PicturesOf(data, frames)).to(torch::kDouble).contiguous();
      positions.insert(positions.end(), seen.data_ptr<double>(),
                       seen.data_ptr<double>() + seen.numel());
    }
    if (progress) progress(s + 1);
  }
  return positions;
}

double SeenError(const std::vector<double>& seen, const DiscData& data) {
  double sum = 0.0;
  size_t at = 0;
  for (int s = 0; s < data.num_sequences(); ++s) {
    for (int k = 0; k < data.frames; ++k) {
      const double* state = data.State(s, k);
      for (int i = 0; i < data.world.size(); ++i) {
        for (int c = 0; c < 2; ++c) {
          const double off = seen[at++] - state[4 * i + c];
          sum += off * off;
        }
      }
    }
  }
  return std::sqrt(sum / static_cast<double>(at));
}

PictureRows DecodeWindow(Trainer* trainer, const DiscData& data, int sequence) {
  const torch::NoGradGuard guard;
  const int seen = trainer->options().seen, ahead = trainer->options().ahead;
  Frames frames;
  for (int k = 0; k < seen + ahead; ++k) frames.emplace_back(sequence, k);
  const at::Tensor truth = PicturesOf(data, frames);
  const at::Tensor positions = trainer->encoder()->Positions(truth.slice(0, 0, seen));
  const Ahead predicted = trainer->dynamics()(trainer->encoder()->State(positions.unsqueeze(0)));
  const at::Tensor decoded =
      trainer->decoder()(torch::cat({positions, predicted.states[0].slice(2, 0, 2)}));
  PictureRows rows;
  for (int k = 0; k < seen + ahead; ++k) {
    rows.truth.push_back(BytesOf(truth[k]));
    rows.predicted.push_back(BytesOf(decoded[k]));
  }
  return rows;
}

}  // namespace tangible
