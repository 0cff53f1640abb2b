// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/rollout_adjoint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../support/scenes.h"
#include "tangible/dynamics/parameter_map.h"
#include "tangible/simulation/rollout_tangent.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// A loss that reads poses and twists all along the run: Σ_k c_k · state_k, c_k pseudo-random.
double Weight(long k, int variable) { return std::sin(1.7 * k + 0.9 * variable); }

TEST(RolloutAdjointTest, LossesAlongTheRunAgreeWithTheTangent) {
  double largest = 0.0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    RandomSceneOptions options;
    options.max_steps = 25;
    Model<double> model;
    State<double> initial, final;
    Scene scene = RandomScene(seed, options);
    BuildModel(scene, &model, &initial);
    const ModelStructure& s = *model.structure;
    const int states = 6 * s.num_bodies();
    RolloutTape tape;
    if (tape.Record(model, initial, Factorisations::kKeep, {}, &final).status !=
        StepStatus::kDone) {
      continue;
    }
    RowMatrixXd w_bar;
    tape.Adjoint(
        model, 1,
        [&](long k, RowMatrixXd* w) {
          for (int i = 0; i < states; ++i) (*w)(i, 0) += Weight(k, i);
        },
        &w_bar);
    // A direction that numbers of the scene can take: it keeps redundant rows consistent.
    ParameterDirection numbers;
    const int count = static_cast<int>(EnumerateNumbers(&scene).size());
    for (int i = 0; i < count; ++i) numbers.push_back({i, Weight(i, seed)});
    RowMatrixXd w_dot = VariableJacobian(scene, model.structure, {numbers});
    const RowMatrixXd direction = w_dot;
    double expected = 0.0;
    double magnitude = 0.0;
    RolloutTangent(
        model, initial,
        [&](long k, double, const State<double>&, const RowMatrixXd& w) {
          for (int i = 0; i < states; ++i) {
            expected += Weight(k, i) * w(i, 0);
            magnitude += std::abs(Weight(k, i) * w(i, 0));
          }
        },
        &w_dot, &final);
    const double actual = (w_bar.transpose() * direction)(0, 0);
    magnitude += w_bar.cwiseAbs().sum();
    EXPECT_NEAR(actual, expected, 1e-11 * magnitude) << seed;
    largest = std::max(largest, std::abs(actual));
  }
  EXPECT_GT(largest, 1.0);
}

TEST(RolloutAdjointTest, RecomputedFactorisationsGiveTheSame) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RowMatrixXd w_bar[2];
  size_t bytes[2];
  for (int k = 0; k < 2; ++k) {
    RolloutTape tape;
    tape.Record(model, initial, k == 0 ? Factorisations::kKeep : Factorisations::kRecompute, {},
                &final);
    EXPECT_EQ(tape.steps(), 63);
    bytes[k] = tape.bytes();
    tape.Adjoint(
        model, 2,
        [&](long step, RowMatrixXd* w) {
          if (step == 63) (*w)(0, 0) += 1.0;
          if (step == 40) (*w)(4, 1) += 1.0;
        },
        &w_bar[k]);
  }
  EXPECT_GT(w_bar[0].norm(), 1.0);
  EXPECT_LT((w_bar[0] - w_bar[1]).norm(), 1e-13 * w_bar[0].norm());
  EXPECT_LT(bytes[1], bytes[0]);
}

TEST(RolloutAdjointTest, ATapeMayBeUsedAgain) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RolloutTape tape, fresh;
  const auto seed = [](long k, RowMatrixXd* w) {
    if (k == 63) (*w)(0, 0) += 1.0;
  };
  RowMatrixXd first, again;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  tape.Adjoint(model, 1, seed, &first);
  initial.twist[0] += 0.1;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  tape.Adjoint(model, 1, seed, &first);
  fresh.Record(model, initial, Factorisations::kKeep, {}, &final);
  fresh.Adjoint(model, 1, seed, &again);
  EXPECT_EQ((first - again).norm(), 0.0);
}

TEST(RolloutAdjointTest, NothingIsSeededNothingComes) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RolloutTape tape;
  tape.Record(model, initial, Factorisations::kKeep, {}, &final);
  RowMatrixXd w_bar;
  tape.Adjoint(
      model, 1, [](long, RowMatrixXd*) {}, &w_bar);
  EXPECT_EQ(w_bar.norm(), 0.0);
  EXPECT_EQ(w_bar.rows(), model.structure->num_variables());
}

}  // namespace
}  // namespace tangible
