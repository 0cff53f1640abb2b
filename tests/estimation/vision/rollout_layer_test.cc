// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/rollout_layer.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "../../support/jets.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

// Three discs of different mass in a box: they meet each other and the walls within a second, and a
// force acts on the first one.
Scene Discs() {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [-0.6, 0.02],
       "velocity": [2, 0.1], "restitution": 0.9, "friction": 0.1, "linear_damping": 0.2},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 0],
       "restitution": 0.9, "friction": 0.1, "linear_damping": 0.2},
      {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 0.5, "position": [0.3, 0.1],
       "restitution": 0.9, "friction": 0.1, "linear_damping": 0.2},
      {"name": "left", "static": true, "restitution": 0.7,
       "shape": {"half_plane": {"normal": [1, 0], "offset": -0.8}}},
      {"name": "right", "static": true, "restitution": 0.7,
       "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.8}}}],
    "forces": [{"name": "push", "body": "a", "force": [0.1, 0]}],
    "simulation": {"stepping": "event", "dt": 0.1, "duration": 1}})",
                         "discs", ".", &scene, &error))
      << error;
  return scene;
}

const std::vector<std::string> kParameters = {"bodies/a/mass", "bodies/*/linear_damping",
                                              "bodies/*/restitution"};

RolloutLayer LayerOf(int threads, std::vector<long> records = {3, 7, 10}) {
  RolloutLayer layer;
  const std::string error = layer.Create(Discs(), {.parameters = kParameters,
                                                   .controls = {"forces/push/force/x"},
                                                   .records = std::move(records),
                                                   .threads = threads});
  EXPECT_EQ(error, "");
  return layer;
}

at::Tensor TensorOf(const double* values, std::vector<int64_t> shape) {
  return torch::from_blob(const_cast<double*>(values), shape, torch::kDouble).clone();
}

// Rows around the scene's own values.
RolloutTensors Inputs(const RolloutLayer& layer, int64_t rows) {
  torch::manual_seed(3);
  const RolloutFunction& f = layer.function();
  RolloutInput own = f.Defaults();
  // The scene's own are not numbers where those of a path differ.
  for (int k = 0; k < f.num_parameters(); ++k) {
    own.parameters[k] = f.parameters()[static_cast<size_t>(k)].value;
  }
  const at::Tensor p = TensorOf(own.parameters.data(), {f.num_parameters()});
  const at::Tensor x = TensorOf(own.state.data(), {f.num_states()});
  const at::Tensor u = TensorOf(own.controls.data(), {f.num_steps(), f.num_controls()});
  const auto around = [&](const at::Tensor& mean, double deviation) {
    std::vector<int64_t> shape = mean.sizes().vec();
    shape.insert(shape.begin(), rows);
    return (mean + deviation * torch::randn(shape, torch::kDouble)).requires_grad_();
  };
  return {around(p, 0.01), around(x, 0.005), around(u, 0.1)};
}

std::vector<at::Tensor> All(const RolloutTensors& inputs) {
  return {inputs.parameters, inputs.state, inputs.controls};
}

// As torch.autograd.gradcheck does: every output's derivative by every input, against central
// differences of the forward pass. Returns the number of derivatives that are not zero.
int GradCheck(const std::function<at::Tensor()>& f, const std::vector<at::Tensor>& inputs) {
  constexpr double kStep = 1e-6;
  const at::Tensor output = f();
  const at::Tensor flat = output.reshape(-1);
  std::vector<std::vector<at::Tensor>> rows;  // [output][input]
  for (int64_t i = 0; i < flat.numel(); ++i) {
    rows.push_back(torch::autograd::grad({flat[i]}, inputs, {}, true, false));
  }
  int not_zero = 0;
  for (size_t k = 0; k < inputs.size(); ++k) {
    for (int64_t j = 0; j < inputs[k].numel(); ++j) {
      at::Tensor difference;
      {
        const torch::NoGradGuard guard;
        double& value = inputs[k].data_ptr<double>()[j];
        const double middle = value;
        value = middle + kStep;
        const at::Tensor plus = f().reshape(-1);
        value = middle - kStep;
        const at::Tensor minus = f().reshape(-1);
        value = middle;
        difference = (plus - minus) / (2.0 * kStep);
      }
      for (int64_t i = 0; i < flat.numel(); ++i) {
        const double adjoint = rows[i][k].reshape(-1)[j].item<double>();
        const double quotient = difference[i].item<double>();
        // Rounding of the states over the step is 1e-10 at most; truncation is of second order.
        EXPECT_NEAR(adjoint, quotient, 1e-7 + 1e-6 * std::abs(quotient))
            << "output " << i << " by entry " << j << " of input " << k;
        not_zero += adjoint != 0.0 && adjoint != quotient ? 1 : 0;
      }
    }
  }
  return not_zero;
}

TEST(RolloutLayerTest, GradCheckThroughImpacts) {
  const RolloutLayer layer = LayerOf(2);
  const RolloutTensors inputs = Inputs(layer, 2);
  const RolledOut rolled = layer(inputs);
  ASSERT_EQ(rolled.messages, std::vector<std::string>(2));
  EXPECT_EQ(rolled.states.sizes(), at::IntArrayRef({2, 3, 18}));
  EXPECT_GT(GradCheck([&] { return layer(inputs).states; }, All(inputs)), 500);
}

TEST(RolloutLayerTest, GradCheckOfInputsThatAllRowsShare) {
  const RolloutLayer layer = LayerOf(2, {10});
  RolloutTensors inputs = Inputs(layer, 2);
  inputs.parameters = inputs.parameters[0].detach().requires_grad_();
  inputs.controls = inputs.controls[1].detach().requires_grad_();
  EXPECT_GT(GradCheck([&] { return layer(inputs).states; }, All(inputs)), 200);
  // None of them batched, and the scene's own state.
  const RolloutTensors single{inputs.parameters, {}, inputs.controls};
  EXPECT_EQ(layer(single).states.sizes(), at::IntArrayRef({1, 18}));
  EXPECT_GT(GradCheck([&] { return layer(single).states; }, {single.parameters, single.controls}),
            50);
}

TEST(RolloutLayerTest, EveryDerivativeIsThatOfImplicitJets) {
  if (!testing::HaveJets()) GTEST_SKIP() << "no width of Jets is built";
  const RolloutLayer layer = LayerOf(1);
  const RolloutFunction& f = layer.function();
  const RolloutTensors inputs = Inputs(layer, 3);
  const at::Tensor states = layer(inputs).states;
  for (int64_t r = 0; r < 3; ++r) {
    RolloutInput input;
    const at::Tensor p = inputs.parameters[r].detach().contiguous();
    const at::Tensor x = inputs.state[r].detach().contiguous();
    const at::Tensor u = inputs.controls[r].detach().contiguous();
    input.parameters = Eigen::Map<VectorX<double>>(p.data_ptr<double>(), p.numel());
    input.state = Eigen::Map<VectorX<double>>(x.data_ptr<double>(), x.numel());
    input.controls = Eigen::Map<RowMatrixXd>(u.data_ptr<double>(), u.size(0), u.size(1));
    RowMatrixXd jacobian;
    GradientMethod used = GradientMethod::kAuto;
    const RolloutOutput output = RolloutWorker(f).Jacobian(
        input, GradientMethod::kJetImplicit, RolloutWorker::Inputs::kAll, &jacobian, &used);
    ASSERT_NE(output.status, RolloutStatus::kRefused) << output.message;
    ASSERT_GT(output.report.events, 0);
    const at::Tensor own = states[r].reshape(-1);
    for (int64_t i = 0; i < own.numel(); ++i) {
      const auto rows = torch::autograd::grad({own[i]}, All(inputs), {}, true, false);
      const at::Tensor row =
          torch::cat({rows[0][r].reshape(-1), rows[1][r].reshape(-1), rows[2][r].reshape(-1)});
      ASSERT_EQ(row.numel(), jacobian.cols());
      for (int64_t j = 0; j < row.numel(); ++j) {
        const double jet = jacobian(i, j);
        ASSERT_NEAR(row[j].item<double>(), jet, 1e-9 * (1.0 + std::abs(jet)))
            << "row " << r << ", output " << i << ", input " << j;
      }
    }
  }
}

TEST(RolloutLayerTest, OfAnyFloatOutsideAndTheSameBitsForAnyNumberOfThreads) {
  const RolloutLayer one = LayerOf(1);
  const RolloutLayer three = LayerOf(3);
  const RolloutTensors inputs = Inputs(one, 8);
  const auto gradients = [&](const RolloutLayer& layer) {
    return torch::autograd::grad({layer(inputs).states.square().sum()}, All(inputs));
  };
  EXPECT_TRUE(torch::equal(one(inputs).states, three(inputs).states));
  const auto by_one = gradients(one);
  const auto by_three = gradients(three);
  for (size_t k = 0; k < 3; ++k) EXPECT_TRUE(torch::equal(by_one[k], by_three[k]));
  RolloutTensors floats;
  floats.state = inputs.state.detach().to(torch::kFloat).requires_grad_();
  const at::Tensor states = one(floats).states;
  EXPECT_EQ(states.scalar_type(), torch::kFloat);
  states.sum().backward();
  EXPECT_EQ(floats.state.grad().scalar_type(), torch::kFloat);
  EXPECT_GT(floats.state.grad().abs().sum().item<float>(), 0.0F);
}

// Graphs nest, outlive their layer, and may be walked in any order: each has tapes of its own.
TEST(RolloutLayerTest, EachGraphHasItsOwnTapes) {
  at::Tensor first, second, direct;
  RolloutTensors a, b;
  {
    const RolloutLayer layer = LayerOf(1, {10});
    a = Inputs(layer, 2);
    b = Inputs(layer, 2);
    b.state = (b.state + 0.01).detach().requires_grad_();
    direct = torch::autograd::grad({layer(a).states.sum()}, {a.state})[0];
    first = layer(a).states;
    second = layer(b).states;
  }
  second.sum().backward();
  first.sum().backward();
  EXPECT_TRUE(torch::equal(a.state.grad(), direct));
  EXPECT_FALSE(torch::equal(b.state.grad(), direct));
}

TEST(RolloutLayerTest, ARowThatIsRefusedStopsNoOther) {
  const RolloutLayer layer = LayerOf(1, {10});
  RolloutTensors inputs = Inputs(layer, 3);
  {
    const torch::NoGradGuard guard;
    inputs.parameters[1][0] = -1.0;
  }
  const RolledOut rolled = layer(inputs);
  EXPECT_EQ(rolled.messages[0], "");
  EXPECT_NE(rolled.messages[1].find("bodies/a/mass"), std::string::npos) << rolled.messages[1];
  EXPECT_TRUE(torch::isnan(rolled.states[1]).all().item<bool>());
  EXPECT_FALSE(torch::isnan(rolled.states[2]).any().item<bool>());
  const auto all = torch::autograd::grad({rolled.states.sum()}, {inputs.state}, {}, true);
  EXPECT_TRUE(torch::isnan(all[0][1]).all().item<bool>());
  EXPECT_FALSE(torch::isnan(all[0][2]).any().item<bool>());
  const at::Tensor kept = rolled.states.index_select(0, torch::tensor({0, 2}));
  const auto good = torch::autograd::grad({kept.sum()}, {inputs.state});
  EXPECT_TRUE(torch::equal(good[0][1], torch::zeros({18}, torch::kDouble)));
  EXPECT_TRUE(torch::equal(good[0][2], all[0][2]));
}

TEST(RolloutLayerTest, WrongInputsAreNamed) {
  const RolloutLayer layer = LayerOf(1);
  const auto message = [&](const RolloutTensors& inputs) -> std::string {
    try {
      layer(inputs);
    } catch (const c10::Error& error) {
      return error.what_without_backtrace();
    }
    return "";
  };
  EXPECT_NE(message({.parameters = torch::ones({2}, torch::kDouble)})
                .find("parameters: expected shape [3]"),
            std::string::npos);
  EXPECT_NE(message({.state = torch::ones({2, 17}, torch::kDouble)})
                .find("state: expected shape [2, 18]"),
            std::string::npos);
  EXPECT_NE(message({.parameters = torch::ones({4, 3}), .state = torch::ones({2, 18})})
                .find("state: expected shape [4, 18], got [2, 18]"),
            std::string::npos);
  EXPECT_NE(message({.parameters = torch::ones({3}, torch::kLong)}).find("floating-point"),
            std::string::npos);
  RolloutLayer none;
  EXPECT_THROW(none({}), c10::Error);
  EXPECT_NE(none.Create(Discs(), {.parameters = {"bodies/nobody/mass"}}), "");
  const RolloutTensors inputs = Inputs(layer, 1);
  EXPECT_THROW(torch::autograd::grad({layer(inputs).states.sum()}, {inputs.state}, {}, {}, true),
               c10::Error);
}

}  // namespace
}  // namespace tangible
