// SPDX-License-Identifier: Apache-2.0
//
// The entries of ∂R/∂w; that they are right as a whole is what the random gradient check shows.
#include "tangible/dynamics/jacobian/equation_jacobian.h"

#include <gtest/gtest.h>

#include "../../support/random_matrix.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/step.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// ∂R/∂w of the step that the stepper has just done, dense.
MatrixX<double> Dense(const Model<double>& model, Stepper* stepper, JacobianRoute route) {
  std::vector<JacobianEntry> entries;
  LocalJacobianScratch scratch;
  VisitJacobian(model, stepper->record().View(stepper->system().contact_block()), route, &scratch,
                EntryListSink{&entries});
  MatrixX<double> dense =
      MatrixX<double>::Zero(3 * stepper->system().num_blocks(), model.structure->num_variables());
  for (const JacobianEntry& e : entries) {
    dense(e.row, e.variable) += e.value;
  }
  // Nothing changes the world's pose: a route may leave its derivatives out.
  for (int i = 0; i < 3; ++i) {
    dense.col(model.structure->PoseVariable(model.structure->world(), i)).setZero();
  }
  return dense;
}

// visit(seed, model, stepper) after each of the first steps of random scenes.
template <typename Visit>
void ForEachStep(int steps, const Visit& visit) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const Scene scene = RandomScene(seed);
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    Stepper stepper(model);
    for (int k = 0; k < steps; ++k) {
      if (stepper.Step(model, k * 0.01, 0.01, &state).status != StepStatus::kDone) break;
      visit(seed, model, &stepper);
    }
  }
}

TEST(LocalJacobianTest, RevoluteByHandIsTheGenericRoute) {
  int revolutes = 0;
  ForEachStep(3, [&](unsigned seed, const Model<double>& model, Stepper* stepper) {
    const MatrixX<double> by_hand = Dense(model, stepper, JacobianRoute::kByHand);
    const MatrixX<double> generic = Dense(model, stepper, JacobianRoute::kGeneric);
    // Sums of a few products: rounding of the largest.
    EXPECT_LT((by_hand - generic).cwiseAbs().maxCoeff(),
              1e-13 * (1.0 + generic.cwiseAbs().maxCoeff()))
        << seed;
    for (const JointIndex& joint : model.structure->joints) {
      revolutes += joint.type == JointType::kRevolute ? 1 : 0;
    }
  });
  EXPECT_GT(revolutes, 90);
}

// One column takes contacts by their adjoint, several by Jets.
TEST(LocalJacobianTest, OneColumnOfTheAdjointIsThatOfSeveral) {
  int contacts = 0;
  ForEachStep(5, [&](unsigned seed, const Model<double>& model, Stepper* stepper) {
    const int rows = 3 * stepper->system().num_blocks();
    const VectorX<double> u = testing::RandomMatrix(rows, 1, seed);
    const SolvedEquations step = stepper->record().View(stepper->system().contact_block());
    LocalJacobianScratch scratch;
    VectorX<double> one = VectorX<double>::Zero(model.structure->num_variables());
    VisitJacobian(model, step, JacobianRoute::kByHand, &scratch,
                  SingleAdjointSink{u.data(), one.data()});
    VectorX<double> several = VectorX<double>::Zero(one.size());
    VisitJacobian(model, step, JacobianRoute::kByHand, &scratch,
                  AdjointSink{u.data(), several.data(), 1});
    // Nothing changes the world's pose: a route may leave its derivatives out.
    for (int i = 0; i < 3; ++i) {
      one[model.structure->PoseVariable(model.structure->world(), i)] = 0.0;
      several[model.structure->PoseVariable(model.structure->world(), i)] = 0.0;
    }
    EXPECT_LT((one - several).cwiseAbs().maxCoeff(), 1e-13 * (1.0 + several.cwiseAbs().maxCoeff()))
        << seed;
    contacts += stepper->system().num_blocks() - model.structure->num_blocks() -
                static_cast<int>(model.structure->joints.size());
  });
  EXPECT_GT(contacts, 100);
}

TEST(LocalJacobianTest, EntriesOfABallThatSlidesByHand) {
  Scene scene = test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01})"));
  scene.bodies[0].velocity.x() = 2.0;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);  // μ = (0 + 0.3) / 2
  Stepper stepper(model);
  ASSERT_EQ(stepper.Step(model, 0.0, 0.01, &state).status, StepStatus::kDone);
  ASSERT_EQ(stepper.record().solution.modes[0], ContactMode::kSlidingPositive);
  const MatrixX<double> J = Dense(model, &stepper, JacobianRoute::kByHand);
  const ModelStructure& s = *model.structure;
  const double impulse = 0.01 * 9.81;
  // R1: m v⁺ − m v − … + μ λ in x: ∂/∂m = v⁺ − v, ∂/∂μ_ball = λ / 2, ∂/∂v = −m, ∂/∂g_x = −h m.
  EXPECT_NEAR(J(0, s.ParameterVariable(s.bodies[0].mass)), -0.15 * impulse, 1e-15);
  EXPECT_NEAR(J(0, s.ParameterVariable(s.bodies[0].friction)), 0.5 * impulse, 1e-15);
  EXPECT_NEAR(J(0, s.TwistVariable(0, 0)), -1.0, 1e-15);
  EXPECT_NEAR(J(0, s.ParameterVariable(kGravityX)), -0.01, 1e-15);
  // R3: the gap over h grows with the ball's height and falls with its radius and the floor's
  // offset.
  EXPECT_NEAR(J(3, s.PoseVariable(0, 1)), 100.0, 1e-12);
  EXPECT_NEAR(J(3, s.ParameterVariable(s.bodies[0].shape_numbers)), -100.0, 1e-12);
  EXPECT_NEAR(J(3, s.ParameterVariable(s.bodies[1].shape_numbers + 2)), -100.0, 1e-12);
  // Friction's torque: the contact's point is midway between the surfaces, so it moves by half of
  // the radius's change.
  EXPECT_NEAR(J(2, s.ParameterVariable(s.bodies[0].shape_numbers)), 0.5 * 0.15 * impulse, 1e-15);
}

TEST(LocalJacobianTest, SinksAreTheEntriesContracted) {
  const double w_dot[] = {1.0, 2.0, 3.0, 4.0};
  double rhs[4] = {0.0, 0.0, 0.0, 0.0};
  TangentSink{w_dot, rhs, 2}(1, 0, 5.0);
  EXPECT_EQ(rhs[2], -5.0);
  EXPECT_EQ(rhs[3], -10.0);
  double w_bar[4] = {0.0, 0.0, 0.0, 0.0};
  AdjointSink{w_dot, w_bar, 2}(1, 0, 5.0);
  EXPECT_EQ(w_bar[0], -15.0);
  EXPECT_EQ(w_bar[1], -20.0);
}

}  // namespace
}  // namespace tangible
