// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tangible/estimation/vision/tolerances.h"

namespace tangible {
namespace {

namespace nn = torch::nn;
using torch::indexing::Ellipsis;
using torch::indexing::None;
using torch::indexing::Slice;

// Positions and velocities are scaled to about 1 for networks.
constexpr double kPositionScale = kPictureSize / 2.0;
constexpr double kSpeedScale = 4.0;
// Weights of pixels are softplus(kSharpness z) / kSharpness: nearly max(0, z), and never flat.
constexpr double kSharpness = 10.0;
constexpr int64_t kFeatures = 12;
constexpr int64_t kHidden = 128;
// Margins around a disc in pixels: of the encoder's second look, because the first one is wrong by
// at most a pixel, and of the area in which the decoder may draw.
constexpr int64_t kSeenBeside = 2;
constexpr int64_t kDrawnBeside = 3;
constexpr double kOutside = -1.0;  // of pixels beyond the picture

at::Tensor ColourTensor(const Colour& colour) {
  return torch::tensor({colour[0], colour[1], colour[2]}, torch::kFloat);
}

at::Tensor ColourMatrix(const DiscWorld& world) {
  std::vector<at::Tensor> rows;
  for (const Colour& colour : world.colours) rows.push_back(ColourTensor(colour));
  return torch::stack(rows);
}

int64_t LargestRadius(const DiscWorld& world) {
  return static_cast<int64_t>(std::ceil(*std::max_element(world.radii.begin(), world.radii.end())));
}

// A network with two hidden layers whose output is 0 at the start.
nn::Sequential Perceptron(int64_t in, int64_t hidden, int64_t out) {
  nn::Linear last(hidden, out);
  torch::nn::init::zeros_(last->weight);
  torch::nn::init::zeros_(last->bias);
  return nn::Sequential(nn::Linear(in, hidden), nn::ReLU(), nn::Linear(hidden, hidden), nn::ReLU(),
                        last);
}

at::Tensor Scaled(const at::Tensor& states) {
  return torch::cat({states.index({Ellipsis, Slice(0, 2)}) / kPositionScale - 1.0,
                     states.index({Ellipsis, Slice(2, 4)}) / kSpeedScale},
                    -1);
}

// From (B, n, S) to (B, n, n S): for each disc its own numbers, then those of the other discs in
// turn.
at::Tensor OwnFirst(const at::Tensor& values) {
  const int64_t n = values.size(1);
  std::vector<at::Tensor> rows;
  for (int64_t i = 0; i < n; ++i) rows.push_back(values.roll(-i, 1).flatten(1));
  return torch::stack(rows, 1);
}

at::Tensor WithNumbers(const at::Tensor& values) {
  const int64_t n = values.size(1);
  return torch::cat({values, torch::eye(n, values.options()).expand({values.size(0), n, n})}, 2);
}

}  // namespace

EncoderImpl::EncoderImpl(const DiscWorld& world, int frames)
    : discs_(world.size()), patch_(2 * (LargestRadius(world) + kSeenBeside) + 1) {
  first_ = register_module("first", nn::Conv2d(nn::Conv2dOptions(3, kFeatures, 3).padding(1)));
  second_ =
      register_module("second", nn::Conv2d(nn::Conv2dOptions(kFeatures, discs_, 3).padding(1)));
  correction_ =
      register_module("correction", Perceptron(3 * patch_ * patch_ + 2 + discs_, kHidden / 2, 2));
  velocity_ =
      register_module("velocity", Perceptron(discs_ * (2 + 2 * (frames - 1)) + discs_, kHidden, 2));
}

void EncoderImpl::StartFromColours(const DiscWorld& world) {
  const torch::NoGradGuard guard;
  // A picture is cloth + Σ shareᵢ (colourᵢ − cloth), so that with three colours the shares are a
  // linear function of the pixel. Feature i is share i, and the weight is the share minus a small
  // threshold.
  const at::Tensor cloth = ColourTensor(world.cloth);
  const at::Tensor shares = torch::linalg_pinv((ColourMatrix(world) - cloth).t());
  for (int i = 0; i < discs_; ++i) {
    first_->weight[i].zero_();
    first_->weight.index_put_({i, Slice(), 1, 1}, shares[i]);
    first_->bias[i] = -shares[i].dot(cloth);
    second_->weight[i].zero_();
    second_->weight.index_put_({i, i, 1, 1}, 8.0);
    second_->bias[i] = -1.2;
  }
}

at::Tensor EncoderImpl::Centres(const at::Tensor& pictures) {
  // Averaging four pixels does not move the centre of a disc.
  const at::Tensor z = second_(torch::relu(first_(torch::avg_pool2d(pictures, 2))));
  const at::Tensor weights = torch::nn::functional::softplus(
                                 z, torch::nn::functional::SoftplusFuncOptions().beta(kSharpness)) +
                             kLeastWeight;
  const at::Tensor at = 2.0 * torch::arange(kPictureSize / 2, pictures.options()) + 1.0;
  const at::Tensor total = weights.sum({2, 3});
  const at::Tensor x = (weights.sum(2) * at).sum(-1) / total;
  const at::Tensor y = (weights.sum(3) * at).sum(-1) / total;
  return torch::stack({x, y}, -1);
}

at::Tensor EncoderImpl::Refine(const at::Tensor& pictures, const at::Tensor& centres) {
  const int64_t rows = pictures.size(0), beside = patch_ / 2, width = kPictureSize + 2 * beside;
  const at::Tensor padded =
      torch::constant_pad_nd(pictures, {beside, beside, beside, beside}, kOutside);
  const at::Tensor pixel = torch::clamp(torch::floor(centres.detach()), 0, kPictureSize - 1);
  const at::Tensor offset = torch::arange(patch_, torch::kLong);
  const at::Tensor first = pixel.to(torch::kLong);
  const at::Tensor x = (first.select(-1, 0).unsqueeze(-1) + offset).unsqueeze(-2);
  const at::Tensor y = (first.select(-1, 1).unsqueeze(-1) + offset).unsqueeze(-1);
  // (N, 3, n P²) to (N, n, 3 P²).
  const at::Tensor which = (y * width + x).reshape({rows, 1, -1}).expand({rows, 3, -1});
  const at::Tensor patches =
      padded.flatten(2).gather(2, which).reshape({rows, 3, discs_, -1}).transpose(1, 2).flatten(2);
  const at::Tensor features = torch::cat({patches, centres - pixel - 0.5}, 2);
  return centres + correction_->forward(WithNumbers(features));
}

at::Tensor EncoderImpl::State(const at::Tensor& positions) {
  const at::Tensor last = positions.select(1, -1);
  const at::Tensor steps = positions.slice(1, 1) - positions.slice(1, 0, -1);
  const at::Tensor features =
      torch::cat({last / kPositionScale - 1.0, steps.transpose(1, 2).flatten(2) / kSpeedScale}, 2);
  const at::Tensor correction = velocity_->forward(WithNumbers(OwnFirst(features)));
  return torch::cat({last, steps.select(1, -1) + kSpeedScale * correction}, -1);
}

DecoderImpl::DecoderImpl(const DiscWorld& world, DecoderKind kind)
    : kind_(kind),
      style_(world.style),
      radius_(world.radii[0]),
      patch_(2 * (LargestRadius(world) + kDrawnBeside)) {
  if (kind_ == DecoderKind::kRenderer) {
    cloth_ = register_buffer("cloth", ColourTensor(world.cloth));
    colours_ = register_buffer("colours", ColourMatrix(world));
    return;
  }
  cloth_ = register_parameter("cloth", torch::full({3}, 0.3));
  colours_ = register_parameter("colours", 0.5 + 0.1 * torch::randn({world.size(), 3}));
  share_ =
      register_module("share", nn::Sequential(nn::Linear(1, 16), nn::Tanh(), nn::Linear(16, 16),
                                              nn::Tanh(), nn::Linear(16, 1), nn::Sigmoid()));
}

at::Tensor DecoderImpl::Share(const at::Tensor& distance) {
  if (kind_ == DecoderKind::kLearned) {
    // The share is 0 at the border of the patch, because the patch moves from pixel to pixel.
    const at::Tensor fade = torch::clamp(0.5 * patch_ - distance, 0.0, 1.0);
    return fade * share_->forward(distance.unsqueeze(-1) - 4.0).squeeze(-1);
  }
  if (style_ == DiscStyle::kSoft) return torch::exp(-torch::pow(distance / radius_, 8));
  return torch::clamp(radius_ + 0.5 - distance, 0.0, 1.0);
}

at::Tensor DecoderImpl::forward(const at::Tensor& positions) {
  const int64_t rows = positions.size(0), n = positions.size(1);
  // Nothing is drawn beyond the picture; positions are clamped, because indices far beyond it would
  // overflow.
  const at::Tensor inside = torch::clamp(positions, -patch_, kPictureSize + patch_);
  const at::Tensor corner = torch::floor(inside.detach()) - patch_ / 2 + 1;
  const at::Tensor offset = torch::arange(patch_, positions.options());
  const at::Tensor x = (corner.select(-1, 0).unsqueeze(-1) + offset).unsqueeze(-2);
  const at::Tensor y = (corner.select(-1, 1).unsqueeze(-1) + offset).unsqueeze(-1);
  const at::Tensor dx = x + 0.5 - inside.select(-1, 0).reshape({rows, n, 1, 1});
  const at::Tensor dy = y + 0.5 - inside.select(-1, 1).reshape({rows, n, 1, 1});
  const at::Tensor distance = torch::sqrt(dx * dx + dy * dy + kSmoothDistance);
  const auto within = [](const at::Tensor& at) { return (at >= 0).logical_and(at < kPictureSize); };
  const at::Tensor drawn = within(x).logical_and(within(y)).expand_as(distance);
  const at::Tensor share = Share(distance) * drawn.to(positions.scalar_type());
  const at::Tensor pixel =
      (torch::clamp(y, 0, kPictureSize - 1) * kPictureSize + torch::clamp(x, 0, kPictureSize - 1))
          .to(torch::kLong)
          .reshape({rows, 1, n * patch_ * patch_});
  const at::Tensor tint = (colours_ - cloth_).t().reshape({1, 3, n, 1});
  const at::Tensor light =
      (share.reshape({rows, 1, n, patch_ * patch_}) * tint).reshape({rows, 3, -1});
  const at::Tensor cloth = cloth_.reshape({1, 3, 1}).expand({rows, 3, kPicturePixels});
  return cloth.scatter_add(2, pixel.expand({rows, 3, -1}), light)
      .reshape({rows, 3, kPictureSize, kPictureSize});
}

const char* NameOf(DynamicsKind kind) {
  switch (kind) {
    case DynamicsKind::kEngine:
      return "engine";
    case DynamicsKind::kPerceptron:
      return "mlp";
    case DynamicsKind::kInteraction:
      return "interaction";
  }
  return "";
}

DynamicsImpl::DynamicsImpl(const DiscWorld& world, const DynamicsOptions& options)
    : options_(options), discs_(world.size()) {
  if (options_.kind == DynamicsKind::kPerceptron) {
    disc_ = register_module("disc", Perceptron(4 * discs_, 2 * kHidden, 4 * discs_));
    return;
  }
  if (options_.kind == DynamicsKind::kInteraction) {
    constexpr int64_t kEffect = 32;
    // The output of this network is an input of the next one and must not be 0 at the start.
    pair_ = register_module("pair", nn::Sequential(nn::Linear(8 + 2 * discs_, 64), nn::ReLU(),
                                                   nn::Linear(64, kEffect), nn::ReLU()));
    disc_ = register_module("disc", Perceptron(4 + discs_ + kEffect, kHidden, 4));
    return;
  }
  std::vector<std::string> paths;
  if (options_.learns_parameters) {
    for (int i = 1; i < discs_; ++i) {
      names_.push_back("mass ratio " + std::to_string(i));
      paths.push_back("bodies/disc" + std::to_string(i) + "/mass");
    }
    names_.insert(names_.end(),
                  {"disc restitution", "side restitution", "end restitution", "damping"});
    paths.insert(paths.end(), {"pairs/disc*:disc*/restitution", "pairs/disc*:side*/restitution",
                               "pairs/disc*:end*/restitution", "bodies/disc*/linear_damping"});
    // The initial values are wrong: equal masses, inelastic impacts, a third of the friction.
    log_masses_ = register_parameter("log_masses", torch::zeros({discs_ - 1}, torch::kDouble));
    restitutions_ = register_parameter("restitutions", torch::full({3}, 0.6, torch::kDouble));
    log_damping_ =
        register_parameter("log_damping", torch::full({1}, std::log(0.006), torch::kDouble));
  }
  std::vector<long> records;
  for (int k = 1; k <= options_.frames; ++k) records.push_back(k);
  const std::string error =
      layer_.Create(SceneOf(world, options_.frames),
                    {.parameters = paths, .records = records, .threads = options_.threads});
  if (!error.empty()) throw std::logic_error("discs: " + error);
}

at::Tensor DynamicsImpl::PhysicalParameters() const {
  return torch::cat({torch::exp(log_masses_), restitutions_, torch::exp(log_damping_)});
}

void DynamicsImpl::Project() {
  const torch::NoGradGuard guard;
  if (restitutions_.defined()) restitutions_.clamp_(0.0, 1.0);
}

Ahead DynamicsImpl::ByEngine(const at::Tensor& state) {
  const int64_t rows = state.size(0);
  const at::Tensor zero = torch::zeros({rows, discs_, 1}, state.options());
  const at::Tensor full = torch::cat({state.slice(2, 0, 2), zero, state.slice(2, 2, 4), zero}, 2);
  RolloutTensors inputs{.state = full.reshape({rows, 6 * discs_})};
  if (options_.learns_parameters) inputs.parameters = PhysicalParameters();
  const RolledOut rolled = layer_(inputs);
  const at::Tensor states =
      rolled.states.reshape({rows, options_.frames, discs_, 6}).to(state.scalar_type());
  std::vector<float> valid;
  for (const std::string& message : rolled.messages) valid.push_back(message.empty() ? 1.0F : 0.0F);
  const at::Tensor run = torch::tensor(valid);
  const at::Tensor kept =
      torch::where(run.reshape({rows, 1, 1, 1}) > 0.5, states, torch::zeros({}, states.options()));
  return {torch::cat({kept.slice(3, 0, 2), kept.slice(3, 3, 5)}, 3), run};
}

at::Tensor DynamicsImpl::OneFrame(const at::Tensor& state) {
  const at::Tensor scaled = Scaled(state);
  at::Tensor change;
  if (options_.kind == DynamicsKind::kPerceptron) {
    change = disc_->forward(scaled.flatten(1)).reshape(state.sizes());
  } else {
    const int64_t rows = state.size(0);
    const at::Tensor numbered = WithNumbers(scaled);
    const int64_t size = numbered.size(2);
    const at::Tensor receiver = numbered.unsqueeze(2).expand({rows, discs_, discs_, size});
    const at::Tensor sender = numbered.unsqueeze(1).expand({rows, discs_, discs_, size});
    const at::Tensor effects = pair_->forward(torch::cat({receiver, sender - receiver}, 3));
    const at::Tensor others = (1.0 - torch::eye(discs_)).reshape({1, discs_, discs_, 1});
    change = disc_->forward(torch::cat({numbered, (effects * others).sum(2)}, 2));
  }
  // The prediction is uniform motion plus a change of position and velocity.
  const at::Tensor velocity = state.slice(2, 2, 4);
  return torch::cat({state.slice(2, 0, 2) + velocity + change.slice(2, 0, 2) * kSpeedScale,
                     velocity + change.slice(2, 2, 4) * kSpeedScale},
                    2);
}

Ahead DynamicsImpl::forward(const at::Tensor& state) {
  if (options_.kind == DynamicsKind::kEngine) return ByEngine(state);
  std::vector<at::Tensor> states;
  at::Tensor now = state;
  for (int k = 0; k < options_.frames; ++k) {
    now = OneFrame(now);
    states.push_back(now);
  }
  return {torch::stack(states, 1), torch::ones({state.size(0)})};
}

}  // namespace tangible
