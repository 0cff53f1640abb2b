// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tangible/estimation/vision/evaluation.h"
#include "tangible/estimation/vision/simb_score.h"
#include "tangible/estimation/vision/training_file.h"

namespace tangible {
namespace {

const DiscData& DataOf(DiscKind kind) {
  static const DiscData billiards =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 8, .frames = 20, .seed = 6});
  static const DiscData simb =
      MakeDiscData({.kind = DiscKind::kSimb, .sequences = 8, .frames = 20, .seed = 6});
  return kind == DiscKind::kSimb ? simb : billiards;
}

std::vector<std::pair<int, int>> SomeFrames() {
  std::vector<std::pair<int, int>> frames;
  for (int s = 0; s < 8; ++s) frames.emplace_back(s, 2 * s + 3);
  return frames;
}

class ModelTest : public ::testing::TestWithParam<DiscKind> {
 protected:
  void SetUp() override {
    torch::set_num_threads(1);
    torch::manual_seed(2);
  }
  const DiscData& data_ = DataOf(GetParam());
  at::Tensor pictures_ = PicturesOf(data_, SomeFrames());
  at::Tensor states_ = StatesOf(data_, SomeFrames());
};

TEST_P(ModelTest, FromColoursTheEncoderSeesToATenthOfAPixel) {
  Encoder encoder(data_.world, 3);
  encoder->StartFromColours(data_.world);
  const at::Tensor off = encoder->Positions(pictures_) - states_.slice(2, 0, 2);
  EXPECT_LT(off.abs().max().item<double>(), 0.2);
  EXPECT_LT(off.square().mean().sqrt().item<double>(), 0.1);
  // Before any training the velocity is the last difference.
  const at::Tensor two = torch::stack({off, off + 0.5}, 1).detach();
  const at::Tensor state = Encoder(data_.world, 2)->State(two);
  EXPECT_TRUE(torch::allclose(state.slice(2, 2, 4), torch::full({8, 3, 2}, 0.5)));
}

// The second look depends on the pixels around the centre alone, wherever they are.
TEST_P(ModelTest, TheSecondLookSeesThePixelsAroundTheCentre) {
  Encoder encoder(data_.world, 3);
  EXPECT_TRUE(torch::equal(encoder->Positions(pictures_), encoder->Centres(pictures_)));
  const torch::NoGradGuard guard;
  for (at::Tensor& weight : encoder->parameters()) weight.normal_(0.0, 0.1);
  const auto corrections = [&](double x, double y) {
    const std::vector<double> places = {20.3 + x, 30.7 + y, 32.1 + x, 31.2 + y, 31.0 + x, 15.6 + y};
    const std::string picture = DrawDiscs(data_.world, places);
    at::Tensor pixels = torch::empty({1, 3, kPictureSize, kPictureSize});
    for (int k = 0; k < kPictureBytes; ++k) {
      pixels.view({-1})[k] = static_cast<unsigned char>(picture[k]) / 255.0;
    }
    const at::Tensor centres = torch::tensor(places).to(torch::kFloat).reshape({1, 3, 2}) + 0.1;
    return encoder->Refine(pixels, centres) - centres;
  };
  const at::Tensor here = corrections(0.0, 0.0);
  EXPECT_TRUE(torch::allclose(here, corrections(7.0, -4.0), 1e-4, 1e-4));
  EXPECT_FALSE(torch::allclose(here, corrections(0.4, 0.0), 1e-2, 1e-2));
  // Beyond the picture's edge pixels are others.
  EXPECT_FALSE(torch::allclose(here, corrections(-19.0, 0.0), 1e-2, 1e-2));
}

TEST_P(ModelTest, TheRendererDrawsThePicturesAndIsDifferentiatedRight) {
  Decoder renderer(data_.world, DecoderKind::kRenderer);
  const at::Tensor drawn = renderer(states_.slice(2, 0, 2));
  // Covered shares of pixels are a function of the distance to 0.1 at the rim.
  EXPECT_LT((drawn - pictures_).square().mean().item<double>(), 2e-5);
  EXPECT_GT((drawn - renderer(states_.slice(2, 0, 2) + 0.5)).square().mean().item<double>(), 1e-4);
  Decoder learned(data_.world, DecoderKind::kLearned);
  learned->to(torch::kDouble);
  const at::Tensor places = states_.slice(2, 0, 2).to(torch::kDouble).requires_grad_();
  const at::Tensor weights = torch::randn({8, 3, kPictureSize, kPictureSize}, torch::kDouble);
  const at::Tensor way = torch::randn({8, 3, 2}, torch::kDouble);
  (learned(places) * weights).sum().backward();
  constexpr double kStep = 1e-6;
  const double quotient =
      ((learned(places + kStep * way) - learned(places - kStep * way)) * weights)
          .sum()
          .item<double>() /
      (2.0 * kStep);
  const double exact = (places.grad() * way).sum().item<double>();
  EXPECT_GT(std::abs(exact), 1e-3);
  EXPECT_NEAR(exact, quotient, 1e-5 * std::abs(exact) + 1e-6);
}

TEST_P(ModelTest, TheEngineFromTheTrueStateIsTheTruthAndNetworksBeginStraight) {
  Dynamics engine(data_.world, DynamicsOptions{.frames = 5});
  const Ahead ahead = engine(states_);
  EXPECT_EQ(ahead.valid.sum().item<double>(), 8.0);
  for (int k = 1; k <= 5; ++k) {
    std::vector<std::pair<int, int>> later = SomeFrames();
    for (auto& [sequence, frame] : later) frame = std::min(frame + k, 19);
    const at::Tensor truth = StatesOf(data_, later);
    const at::Tensor off = (ahead.states.select(1, k - 1) - truth).abs();
    // Floats outside; the last frames of the last sequences lie beyond the data. SimB's own impacts
    // are late by up to a substep each.
    const double bound = GetParam() == DiscKind::kSimb ? 12.0 : 1e-3;
    EXPECT_LT(off.slice(0, 0, 5).max().item<double>(), bound) << k;
  }
  for (const DynamicsKind kind : {DynamicsKind::kPerceptron, DynamicsKind::kInteraction}) {
    Dynamics network(data_.world, DynamicsOptions{.kind = kind, .frames = 5});
    const at::Tensor straight = states_.slice(2, 0, 2) + 5.0 * states_.slice(2, 2, 4);
    EXPECT_TRUE(
        torch::allclose(network(states_).states.select(1, 4).slice(2, 0, 2), straight, 1e-5, 1e-4));
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, ModelTest,
                         ::testing::Values(DiscKind::kBilliards, DiscKind::kSimb));

TrainingOptions Small() {
  TrainingOptions options;
  options.batch = 6;
  options.iterations = 8;
  options.labels = 0.5;
  return options;
}

std::vector<at::Tensor> WeightsOf(Trainer* trainer) {
  std::vector<at::Tensor> all = trainer->encoder()->parameters();
  for (const at::Tensor& weight : trainer->decoder()->parameters()) all.push_back(weight);
  for (const at::Tensor& weight : trainer->dynamics()->parameters()) all.push_back(weight);
  return all;
}

void ExpectSameWeights(Trainer* a, Trainer* b) {
  const std::vector<at::Tensor> mine = WeightsOf(a), others = WeightsOf(b);
  ASSERT_EQ(mine.size(), others.size());
  for (size_t k = 0; k < mine.size(); ++k) EXPECT_TRUE(torch::equal(mine[k], others[k])) << k;
}

TEST(TrainerTest, AnInterruptedTrainingEndsWithTheSameBits) {
  const DiscData& data = DataOf(DiscKind::kBilliards);
  Trainer whole(data, Small());
  std::string checkpoint;
  while (whole.iteration() < 8) {
    whole.Step();
    if (whole.iteration() == 3) checkpoint = whole.Save();
  }
  Trainer resumed(data, Small());
  std::string error;
  ASSERT_TRUE(resumed.Load(checkpoint, "c", &error)) << error;
  EXPECT_EQ(resumed.iteration(), 3);
  while (resumed.iteration() < 8) resumed.Step();
  ExpectSameWeights(&resumed, &whole);
  std::string damaged = checkpoint;
  damaged[damaged.size() - 100] ^= 1;
  EXPECT_FALSE(resumed.Load(damaged, "c", &error));
  EXPECT_NE(error.find("c: the checkpoint is damaged"), std::string::npos) << error;
  EXPECT_FALSE(resumed.Load("what else", "c", &error));
  EXPECT_NE(error.find("another file"), std::string::npos) << error;
  EXPECT_FALSE(resumed.Load("", "c", &error));
  EXPECT_NE(error.find("empty file"), std::string::npos) << error;
  TrainingOptions other = Small();
  other.seed = 1;
  Trainer elsewhere(data, other);
  EXPECT_FALSE(elsewhere.Load(checkpoint, "c", &error));
  EXPECT_NE(error.find("another one"), std::string::npos) << error;
}

// The archive of a trainer with the moments of Adam of other tensors, one number each.
std::string WithSmallMoments(Trainer* trainer) {
  std::vector<at::Tensor> networks, physical;
  for (const at::Tensor& weight : WeightsOf(trainer)) {
    (weight.scalar_type() == torch::kDouble ? physical : networks)
        .push_back(torch::ones({1}, weight.options()).requires_grad_());
  }
  std::vector<torch::optim::OptimizerParamGroup> groups{
      torch::optim::OptimizerParamGroup(networks)};
  if (!physical.empty()) groups.emplace_back(physical);
  torch::optim::Adam adam(groups, torch::optim::AdamOptions(0.1));
  for (const at::Tensor& tensor : networks) tensor.mutable_grad() = torch::ones_like(tensor);
  for (const at::Tensor& tensor : physical) tensor.mutable_grad() = torch::ones_like(tensor);
  adam.step();
  torch::serialize::OutputArchive archive, encoder, decoder, dynamics, moments;
  trainer->encoder()->save(encoder);
  trainer->decoder()->save(decoder);
  trainer->dynamics()->save(dynamics);
  adam.save(moments);
  archive.write("encoder", encoder);
  archive.write("decoder", decoder);
  archive.write("dynamics", dynamics);
  archive.write("adam", moments);
  std::ostringstream stream;
  archive.save_to(stream);
  return stream.str();
}

// Checkpoints with a right checksum whose weights are none, or those of another network.
TEST(TrainerTest, ForgedWeightsAreOneLine) {
  const DiscData& data = DataOf(DiscKind::kBilliards);
  TrainingOptions with_network = Small();
  with_network.dynamics = DynamicsKind::kPerceptron;
  Trainer trainer(data, Small()), other(data, with_network);
  trainer.Step();
  other.Step();
  std::string error;
  TrainingFile mine, others;
  ASSERT_TRUE(ParseTraining(trainer.Save(), "c", &mine, &error)) << error;
  ASSERT_TRUE(ParseTraining(other.Save(), "c", &others, &error)) << error;
  const auto refuse = [&](TrainingFile forged) {
    forged.fingerprint = mine.fingerprint;
    error.clear();
    EXPECT_FALSE(Trainer(data, Small()).Load(SerializeTraining(forged), "c", &error))
        << forged.iteration << ", " << forged.weights.size() << " bytes";
    EXPECT_EQ(error.rfind("c: expected the weights of this training, got ", 0), 0U) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_EQ(error.find("frame #"), std::string::npos) << error;
    EXPECT_LT(error.size(), 1000U);
  };
  refuse(others);
  refuse({"", 1, "no archive"});
  refuse({"", 1, ""});
  refuse({"", 1, mine.weights.substr(0, mine.weights.size() / 2)});
  refuse({"", 9, mine.weights});
  // A wider encoder's weights have the right names.
  TrainingOptions longer = Small();
  longer.seen = 4;
  Trainer wider(data, longer);
  wider.Step();
  ASSERT_TRUE(ParseTraining(wider.Save(), "c", &others, &error)) << error;
  refuse(others);
  refuse({"", 1, WithSmallMoments(&trainer)});
  EXPECT_TRUE(Trainer(data, Small()).Load(SerializeTraining(mine), "c", &error)) << error;
}

// Labels that are not to be used are NaN.
TEST(TrainerTest, StatesWithoutLabelsAreNotRead) {
  DiscData hidden = DataOf(DiscKind::kBilliards);
  for (int s = 4; s < hidden.num_sequences(); ++s) {
    for (double& x : hidden.sequences[s].states) x = NAN;
  }
  Trainer with(DataOf(DiscKind::kBilliards), Small()), without(hidden, Small());
  for (int k = 0; k < 4; ++k) {
    const TrainingLoss loss = with.Step();
    EXPECT_EQ(without.Step().total, loss.total);
    EXPECT_TRUE(std::isfinite(loss.total));
    EXPECT_GT(loss.encoder, 0.0);
  }
  ExpectSameWeights(&with, &without);
}

TEST(TrainerTest, ParametersMoveTowardsTheTruthWithoutLabels) {
  TrainingOptions options;
  options.labels = 0.0;
  options.batch = 8;
  options.iterations = 40;
  options.decoder = DecoderKind::kRenderer;
  options.starts_from_colours = true;
  options.self_consistency = true;
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 40, .frames = 20, .seed = 7});
  Trainer trainer(data, options);
  EXPECT_EQ(trainer.dynamics()->PhysicalParameters()[0].item<double>(), 1.0);
  while (trainer.iteration() < options.iterations) trainer.Step();
  const at::Tensor found = trainer.dynamics()->PhysicalParameters();
  // From 1, 1 and 0.6 towards 2, 0.5 and 0.9.
  EXPECT_GT(found[0].item<double>(), 1.2);
  EXPECT_LT(found[1].item<double>(), 0.8);
  EXPECT_GT(found[2].item<double>(), 0.65);
}

}  // namespace
}  // namespace tangible
