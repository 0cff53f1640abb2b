// SPDX-License-Identifier: Apache-2.0
//
// A ball's restitution, learned from where it is seen.
#include <torch/torch.h>

#include <cstdio>

#include "tangible/estimation/vision/rollout_layer.h"
#include "tangible/scene/scene_json.h"

int main() {
  torch::set_num_threads(1);
  tangible::Scene scene;
  std::string error;
  tangible::ParseScene(
      R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
                      "position": [0, 1], "velocity": [1, 0], "restitution": 0.8},
                     {"name": "floor", "static": true, "restitution": 0.8,
                      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
          "simulation": {"stepping": "event", "dt": 0.02, "duration": 1}})",
      "ball", ".", &scene, &error);
  tangible::RolloutLayer layer;
  layer.Create(scene, {.parameters = {"bodies/*/restitution"}, .records = {30, 40, 50}});
  const torch::Tensor seen = layer({}).states.slice(-1, 0, 2);
  torch::Tensor restitution = torch::tensor({0.5}, torch::kDouble).requires_grad_();
  torch::optim::Adam optimiser({restitution}, torch::optim::AdamOptions(0.02));
  for (int k = 0; k < 200; ++k) {
    optimiser.zero_grad();
    const torch::Tensor states = layer({.parameters = restitution}).states;
    (states.slice(-1, 0, 2) - seen).square().sum().backward();
    optimiser.step();
  }
  std::printf("restitution %.4f\n", restitution.item<double>());
  return std::abs(restitution.item<double>() - 0.8) < 1e-3 ? 0 : 1;
}
