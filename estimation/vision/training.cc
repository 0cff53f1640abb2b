// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/training.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tangible/estimation/vision/tolerances.h"
#include "tangible/estimation/vision/training_file.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

namespace nn = torch::nn;

// Weights of the losses, whose units are pixels² and squares of colour values.
constexpr double kPositionWeight = 30.0;  // positions are seen to hundredths of pixels
constexpr double kPhysicsWeight = 0.3;
constexpr double kDecoderWeight = 100.0;
constexpr double kSelfWeight = 0.3;
constexpr int kDrawn = 3;  // frames ahead that are decoded in a row
// The rate of the physical parameters over that of the networks: they are few, and one step of Adam
// changes each by a fraction of its value.
constexpr double kPhysicalRate = 10.0;
constexpr double kClip = 10.0;

// splitmix64 (Steele, Lea, Flood 2014): numbers that depend on seed and counter alone.
std::uint64_t Mix(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31);
}

// The mean of values whose rows have the `weights` (B).
at::Tensor WeightedMean(const at::Tensor& values, const at::Tensor& weights) {
  return (values.flatten(1).mean(1) * weights).sum() / torch::clamp_min(weights.sum(), 1.0);
}

at::Tensor Huber(const at::Tensor& difference) {
  return nn::functional::smooth_l1_loss(
      difference, torch::zeros_like(difference),
      nn::functional::SmoothL1LossFuncOptions().reduction(torch::kNone));
}

at::Tensor Positions(const at::Tensor& states) { return states.slice(-1, 0, 2); }

}  // namespace

at::Tensor PicturesOf(const DiscData& data, const std::vector<std::pair<int, int>>& frames) {
  at::Tensor bytes = torch::empty(
      {static_cast<int64_t>(frames.size()), 3, kPictureSize, kPictureSize}, torch::kByte);
  for (size_t k = 0; k < frames.size(); ++k) {
    const auto [sequence, frame] = frames[k];
    if (!Decompress(data.sequences[sequence].pictures[frame],
                    bytes.data_ptr<uint8_t>() + k * kPictureBytes)) {
      throw std::runtime_error("picture " + std::to_string(frame) + " of sequence " +
                               std::to_string(sequence) + ": damaged");
    }
  }
  return bytes.to(torch::kFloat) / 255.0;
}

at::Tensor StatesOf(const DiscData& data, const std::vector<std::pair<int, int>>& frames) {
  at::Tensor states =
      torch::empty({static_cast<int64_t>(frames.size()), data.world.size(), 4}, torch::kFloat);
  float* at = states.data_ptr<float>();
  for (const auto& [sequence, frame] : frames) {
    at = std::copy_n(data.State(sequence, frame), 4 * data.world.size(), at);
  }
  return states;
}

struct Trainer::Batch {
  at::Tensor pictures;  ///< (B, K, 3, 64, 64)
  at::Tensor later;     ///< (B, kDrawn, 3, 64, 64)
  at::Tensor drawn;     ///< (B, kDrawn): which of the F frames ahead
  at::Tensor seen;      ///< true states (B, K, n, 4)
  at::Tensor ahead;     ///< (B, F, n, 4)
  at::Tensor labelled;  ///< (B), 1 or 0
};

Trainer::Trainer(const DiscData& data, const TrainingOptions& options)
    : data_(data), options_(options) {
  if (data.frames < options.seen + options.ahead) {
    throw std::invalid_argument("training: expected sequences of at least " +
                                std::to_string(options.seen + options.ahead) + " frames, got " +
                                std::to_string(data.frames));
  }
  torch::manual_seed(options.seed);
  encoder_ = Encoder(data.world, options.seen);
  if (options.starts_from_colours) encoder_->StartFromColours(data.world);
  decoder_ = Decoder(data.world, options.decoder);
  dynamics_ = Dynamics(data.world, DynamicsOptions{.kind = options.dynamics,
                                                   .frames = options.ahead,
                                                   .learns_parameters = options.learns_parameters});
  std::vector<at::Tensor> networks, physical;
  for (auto* module :
       std::initializer_list<nn::Module*>{encoder_.get(), decoder_.get(), dynamics_.get()}) {
    for (const at::Tensor& parameter : module->parameters()) {
      (parameter.scalar_type() == torch::kDouble ? physical : networks).push_back(parameter);
    }
  }
  std::vector<torch::optim::OptimizerParamGroup> groups{
      torch::optim::OptimizerParamGroup(networks)};
  if (!physical.empty()) groups.emplace_back(physical);
  adam_ = std::make_unique<torch::optim::Adam>(groups,
                                               torch::optim::AdamOptions(options.learning_rate));
}

Trainer::~Trainer() = default;

Trainer::Batch Trainer::Draw() const {
  const int count = data_.num_sequences();
  const int labelled = static_cast<int>(std::ceil(options_.labels * count - kLabelRounding));
  std::uint64_t counter = Mix(options_.seed) ^ (static_cast<std::uint64_t>(iteration_) << 20);
  const auto below = [&](int n) {
    return static_cast<int>(Mix(counter++) % static_cast<std::uint64_t>(n));
  };
  std::vector<std::pair<int, int>> seen, ahead, later;
  std::vector<int64_t> drawn;
  std::vector<float> flags;
  for (int row = 0; row < options_.batch; ++row) {
    // Half of the rows have labels, whatever their share of the sequences.
    const bool with = labelled == count || (labelled > 0 && row < options_.batch / 2);
    const int sequence = with ? below(labelled) : labelled + below(count - labelled);
    const int first = below(data_.frames - options_.seen - options_.ahead + 1);
    flags.push_back(with ? 1.0F : 0.0F);
    for (int k = 0; k < options_.seen; ++k) seen.emplace_back(sequence, first + k);
    const int next = first + options_.seen;
    for (int k = 0; k < options_.ahead; ++k) ahead.emplace_back(sequence, next + k);
    for (int k = 0; k < kDrawn; ++k) {
      drawn.push_back(below(options_.ahead));
      later.emplace_back(sequence, next + static_cast<int>(drawn.back()));
    }
  }
  const int64_t rows = options_.batch, n = data_.world.size();
  const at::Tensor with_labels = torch::tensor(flags);
  // The states of rows without labels are not used.
  const auto labels = [&](const std::vector<std::pair<int, int>>& frames, int count) {
    return torch::where(with_labels.reshape({rows, 1, 1, 1}) > 0.5,
                        StatesOf(data_, frames).reshape({rows, count, n, 4}), torch::zeros({}));
  };
  return {PicturesOf(data_, seen).reshape({rows, options_.seen, 3, kPictureSize, kPictureSize}),
          PicturesOf(data_, later).reshape({rows, kDrawn, 3, kPictureSize, kPictureSize}),
          torch::tensor(drawn).reshape({rows, kDrawn}),
          labels(seen, options_.seen),
          labels(ahead, options_.ahead),
          with_labels};
}

TrainingLoss Trainer::Loss(const Batch& batch, at::Tensor* total) {
  const int64_t rows = options_.batch, n = data_.world.size();
  const at::Tensor with = batch.labelled, without = 1.0 - batch.labelled;
  const at::Tensor flags = with.reshape({rows, 1, 1}) > 0.5;
  const at::Tensor seen = batch.pictures.flatten(0, 1);
  const at::Tensor centres = encoder_->Centres(seen);
  const at::Tensor positions = encoder_->Refine(seen, centres).reshape({rows, options_.seen, n, 2});
  const at::Tensor estimate = encoder_->State(positions);
  const at::Tensor truth = batch.seen.select(1, -1);
  const at::Tensor places_seen = Positions(batch.seen);
  // Estimated velocities are wrong by pixels per frame after an impact, which must not change
  // positions.
  const at::Tensor labelled = encoder_->State(positions.detach());
  const at::Tensor encoder_loss =
      WeightedMean((centres.reshape(positions.sizes()) - places_seen).square(), with) +
      kPositionWeight * WeightedMean((positions - places_seen).square(), with) +
      WeightedMean((labelled - truth).slice(2, 2, 4).square(), with);
  const Ahead ahead = dynamics_(torch::where(flags, truth, estimate));
  const at::Tensor physics_loss =
      WeightedMean(Huber(ahead.states - batch.ahead), with * ahead.valid);
  // The frames ahead that are decoded: at the true positions with labels, otherwise at the
  // predicted ones.
  const at::Tensor four = flags.unsqueeze(3);
  const at::Tensor which = batch.drawn.reshape({rows, kDrawn, 1, 1}).expand({rows, kDrawn, n, 2});
  const at::Tensor later =
      torch::where(four, Positions(batch.ahead), Positions(ahead.states)).gather(1, which);
  const at::Tensor now = torch::where(flags, Positions(truth), positions.select(1, -1));
  const at::Tensor places = torch::cat({now.unsqueeze(1), later}, 1);
  const at::Tensor pictures = torch::cat({batch.pictures.slice(1, -1), batch.later}, 1);
  const at::Tensor decoded = decoder_(places.flatten(0, 1)).reshape(pictures.sizes());
  const at::Tensor run = torch::where(with > 0.5, torch::ones_like(with), ahead.valid);
  const at::Tensor decoder_loss = WeightedMean((decoded - pictures).square(), run);
  at::Tensor self_loss = torch::zeros({});
  if (options_.self_consistency) {
    const at::Tensor seen_later =
        encoder_->Positions(batch.later.flatten(0, 1)).reshape({rows, kDrawn, n, 2});
    self_loss = WeightedMean(Huber(Positions(ahead.states).gather(1, which) - seen_later),
                             without * ahead.valid);
  }
  *total = encoder_loss + kDecoderWeight * decoder_loss + kSelfWeight * self_loss +
           (options_.physics_loss ? kPhysicsWeight : 0.0) * physics_loss;
  return {total->item<double>(), encoder_loss.item<double>(), physics_loss.item<double>(),
          decoder_loss.item<double>(), self_loss.item<double>()};
}

TrainingLoss Trainer::Step() {
  const double share = static_cast<double>(iteration_) / static_cast<double>(options_.iterations);
  const double rate =
      options_.learning_rate * (0.02 + 0.98 * 0.5 * (1.0 + std::cos(M_PI * std::min(1.0, share))));
  for (size_t g = 0; g < adam_->param_groups().size(); ++g) {
    static_cast<torch::optim::AdamOptions&>(adam_->param_groups()[g].options())
        .lr(g == 0 ? rate : kPhysicalRate * rate);
  }
  adam_->zero_grad();
  at::Tensor total;
  const TrainingLoss loss = Loss(Draw(), &total);
  total.backward();
  std::vector<at::Tensor> networks = adam_->param_groups()[0].params();
  torch::nn::utils::clip_grad_norm_(networks, kClip);
  adam_->step();
  dynamics_->Project();
  ++iteration_;
  return loss;
}

std::string Trainer::Fingerprint() const {
  std::ostringstream text;
  text.precision(17);
  text << NameOf(data_.kind) << ' ' << data_.seed << ' ' << data_.num_sequences() << ' '
       << data_.frames << ' ' << NameOf(options_.dynamics) << ' '
       << static_cast<int>(options_.decoder) << ' ' << options_.labels << ' '
       << options_.physics_loss << options_.self_consistency << options_.learns_parameters
       << options_.starts_from_colours << ' ' << options_.seen << ' ' << options_.ahead << ' '
       << options_.batch << ' ' << options_.iterations << ' ' << options_.learning_rate << ' '
       << options_.seed;
  return text.str();
}

std::string Trainer::Save() {
  torch::serialize::OutputArchive archive;
  torch::serialize::OutputArchive encoder, decoder, dynamics, adam;
  encoder_->save(encoder);
  decoder_->save(decoder);
  dynamics_->save(dynamics);
  adam_->save(adam);
  archive.write("encoder", encoder);
  archive.write("decoder", decoder);
  archive.write("dynamics", dynamics);
  archive.write("adam", adam);
  std::ostringstream stream;
  archive.save_to(stream);
  return SerializeTraining({Fingerprint(), iteration_, stream.str()});
}

bool Trainer::Load(const std::string& bytes, const std::string& name_for_messages,
                   std::string* error) {
  TrainingFile file;
  if (!ParseTraining(bytes, name_for_messages, &file, error)) return false;
  if (file.fingerprint != Fingerprint()) {
    *error = OneLine(name_for_messages + ": expected the checkpoint of this training (" +
                     Fingerprint() + "), got that of another one (" + file.fingerprint + ")");
    return false;
  }
  const std::string wrong = file.iteration > options_.iterations
                                ? "an iteration behind the last one"
                                : LoadWeights(file.weights);
  if (!wrong.empty()) {
    *error = name_for_messages + ": expected the weights of this training, got " + wrong;
    return false;
  }
  iteration_ = file.iteration;
  return true;
}

// Torch throws with a stack of calls where an archive is none, and takes weights of any sizes.
std::string Trainer::LoadWeights(const std::string& weights) {
  const auto shapes = [this] {
    std::vector<std::pair<std::vector<int64_t>, at::ScalarType>> all;
    for (auto* module :
         std::initializer_list<nn::Module*>{encoder_.get(), decoder_.get(), dynamics_.get()}) {
      for (const at::Tensor& tensor : module->parameters()) {
        all.emplace_back(tensor.sizes().vec(), tensor.scalar_type());
      }
    }
    return all;
  };
  const auto before = shapes();
  try {
    torch::serialize::InputArchive archive, encoder, decoder, dynamics, adam;
    archive.load_from(weights.data(), weights.size());
    archive.read("encoder", encoder);
    archive.read("decoder", decoder);
    archive.read("dynamics", dynamics);
    archive.read("adam", adam);
    encoder_->load(encoder);
    decoder_->load(decoder);
    dynamics_->load(dynamics);
    adam_->load(adam);
  } catch (const c10::Error& exception) {
    return "others: " + OneLine(exception.what_without_backtrace());
  } catch (const std::exception& exception) {
    return "others: " + OneLine(exception.what());
  }
  return shapes() == before ? WrongMoments() : "some of other sizes";
}

// What is wrong with the moments of Adam, which torch takes with any sizes, or empty.
std::string Trainer::WrongMoments() const {
  const auto fits = [](const at::Tensor& moment, const at::Tensor& parameter) {
    return moment.defined() && moment.sizes() == parameter.sizes() &&
           moment.scalar_type() == parameter.scalar_type();
  };
  const auto& states = adam_->state();
  for (const torch::optim::OptimizerParamGroup& group : adam_->param_groups()) {
    for (const at::Tensor& parameter : group.params()) {
      const auto found = states.find(c10::guts::to_string(parameter.unsafeGetTensorImpl()));
      // A parameter without a gradient has none.
      if (found == states.end()) continue;
      const auto& state = static_cast<const torch::optim::AdamParamState&>(*found->second);
      if (!fits(state.exp_avg(), parameter) || !fits(state.exp_avg_sq(), parameter)) {
        return "moments of other sizes";
      }
    }
  }
  return "";
}

}  // namespace tangible
