// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/joint_projection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/drift.h"
#include "../../support/random_matrix.h"
#include "../../support/rescaled.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// A scene's model and state, its poses pushed off the joints.
void Disturbed(unsigned seed, double size, Model<double>* model, State<double>* state) {
  BuildModel(RandomScene(seed), model, state);
  RandomNumbers random(seed);
  for (const int body : model->structure->moving) {
    for (int i = 0; i < 3; ++i) {
      state->pose[3 * body + i] += size * random.Uniform(-1.0, 1.0);
    }
  }
}

TEST(JointProjectionTest, ClosesJointsAndIsLeastInTheMassMetric) {
  int projected = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Model<double> model;
    State<double> state;
    Disturbed(seed, 1e-3, &model, &state);
    if (model.structure->joints.empty()) continue;
    const State<double> from = state;
    JointProjection projection;
    ASSERT_TRUE(projection.Project(model, state.pose, &state)) << seed;
    EXPECT_LE(JointDrift(model, state), 1e-10);
    EXPECT_GT(JointDrift(model, from), 1e-5);
    ++projected;
    // Again: nothing moves.
    const State<double> once = state;
    ASSERT_TRUE(projection.Project(model, state.pose, &state));
    for (size_t i = 0; i < state.pose.size(); ++i) {
      EXPECT_NEAR(state.pose[i], once.pose[i], 1e-10);
    }
  }
  EXPECT_GT(projected, 10);
}

TEST(JointProjectionTest, TangentIsTheDifferenceAndAdjointItsTranspose) {
  int compared = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Model<double> model;
    State<double> state;
    Disturbed(seed, 1e-3, &model, &state);
    const ModelStructure& s = *model.structure;
    // In a loop a change of single numbers contradicts redundant rows.
    if (s.joints.empty() || s.joint_loops) continue;
    ++compared;
    const int n = s.num_variables();
    RowMatrixXd w_dot = testing::RandomMatrix(n, 2, seed);
    const RowMatrixXd direction = w_dot;
    State<double> projected = state;
    JointProjection projection;
    projection.Project(model, projected.pose, &projected);
    projection.Tangent(model, w_dot.data(), 2);
    RowMatrixXd w_bar = testing::RandomMatrix(n, 2, 100 + seed);
    const RowMatrixXd seedling = w_bar;
    projection.Adjoint(model, w_bar.data(), 2);
    // ⟨w̄⁺, ẇ⁺⟩ = ⟨w̄, ẇ⟩
    const MatrixX<double> after = seedling.transpose() * w_dot;
    const MatrixX<double> before = w_bar.transpose() * direction;
    EXPECT_LT((after - before).norm(), 1e-8 * (1.0 + after.norm())) << seed;
    // Differences along the first direction.
    const double h = 1e-6;
    const auto at = [&](double step) {
      Model<double> moved = model;
      State<double> q = state;
      for (size_t i = 0; i < q.pose.size(); ++i) q.pose[i] += step * direction(i, 0);
      for (int i = 0; i < s.num_parameters; ++i) {
        moved.parameters[i] += step * direction(s.ParameterVariable(i), 0);
      }
      JointProjection other;
      EXPECT_TRUE(other.Project(moved, q.pose, &q));
      return q;
    };
    const State<double> high = at(h);
    const State<double> low = at(-h);
    for (const int body : s.moving) {
      for (int i = 0; i < 3; ++i) {
        const int k = 3 * body + i;
        const double difference = (high.pose[k] - low.pose[k]) / (2.0 * h);
        // Tolerance of Newton's iteration over h, and curvature h².
        EXPECT_NEAR(difference, w_dot(k, 0), 1e-6 * (1.0 + std::abs(difference))) << seed;
      }
    }
  }
  EXPECT_GT(compared, 10);
}

// Redundant rows are regularised and derivatives refined. Poses change alone, as a change of single
// numbers contradicts redundant rows; by as much as a step's drift, as directions before and after
// the projection differ by as much, and the matrix with them from one that is merely redundant.
TEST(JointProjectionTest, InLoopsTheAdjointIsTheTransposeToRounding) {
  int compared = 0;
  for (unsigned seed = 1; seed <= 120; ++seed) {
    Model<double> model;
    State<double> state;
    Disturbed(seed, 1e-6, &model, &state);
    const ModelStructure& s = *model.structure;
    if (!s.joint_loops) continue;
    ++compared;
    RowMatrixXd w_dot = RowMatrixXd::Zero(s.num_variables(), 2);
    RowMatrixXd w_bar = w_dot;
    for (const int body : s.moving) {
      w_dot.middleRows(s.PoseVariable(body, 0), 3) = testing::RandomMatrix(3, 2, seed + body);
      w_bar.middleRows(s.PoseVariable(body, 0), 3) = testing::RandomMatrix(3, 2, 500 + seed + body);
    }
    const RowMatrixXd direction = w_dot;
    const RowMatrixXd seedling = w_bar;
    JointProjection projection;
    ASSERT_TRUE(projection.Project(model, state.pose, &state)) << seed;
    projection.Tangent(model, w_dot.data(), 2);
    projection.Adjoint(model, w_bar.data(), 2);
    const MatrixX<double> after = seedling.transpose() * w_dot;
    const MatrixX<double> before = w_bar.transpose() * direction;
    EXPECT_LT((after - before).norm(), 1e-11 * seedling.norm() * w_dot.norm()) << seed;
  }
  EXPECT_GE(compared, 5);
}

TEST(JointProjectionTest, ARolloutsJointsHold) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"box": {"size": [0.1, 1]}}, "mass": 2, "position": [0, -0.5]},
      {"name": "b", "shape": {"box": {"size": [0.1, 1]}}, "mass": 3, "position": [0, -1.5]}],
    "joints": [{"name": "j", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "angle": 1, "rate": 3},
               {"name": "k", "type": "revolute", "bodies": ["b", "a"], "anchor": [0, -1]}],
    "simulation": {"dt": 0.01, "duration": 3}})");
  double drift[2];
  for (int k = 0; k < 2; ++k) {
    scene.simulation.joint_correction =
        k == 0 ? JointCorrection::kNone : JointCorrection::kProjection;
    const testing::DriftOfRun run = testing::RunForDrift(scene);
    EXPECT_EQ(run.report.status, StepStatus::kDone);
    drift[k] = run.largest;
  }
  EXPECT_GT(drift[0], 1e-4);
  EXPECT_LE(drift[1], 1e-10);
}

// Directions frozen at the poses before the projection have no solution here, from step 45 on.
TEST(JointProjectionTest, AChainThatWhipsHolds) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(test_scenes::WhippingChain(2.0)), &model, &state);
  double largest = 0.0;
  double drift = 0.0;
  const RolloutReport report = Rollout(
      model, state,
      [&](long, double, const State<double>& q, Stepper* stepper) {
        largest = std::max(largest, JointDrift(model, q));
        if (stepper != nullptr) {
          State<double> moved = stepper->record().before;
          for (const int body : model.structure->moving) {
            for (int i = 0; i < 3; ++i) {
              moved.pose[3 * body + i] += 0.01 * stepper->record().new_twist[3 * body + i];
            }
          }
          drift = std::max(drift, JointDrift(model, moved));
        }
      },
      &state);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_LE(largest, 1e-10);
  EXPECT_GT(drift, 2e-3);
}

TEST(JointProjectionTest, JointsThatCannotHoldAreReported) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "a", "mass": 2, "inertia": 1, "position": [0, 0]}],
    "joints": [{"name": "j", "type": "distance", "bodies": ["a", "world"],
                "anchors": [[0, 0], [1, 0]]},
               {"name": "k", "type": "distance", "bodies": ["a", "world"],
                "anchors": [[0, 0], [-1, 0]]}]})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  model.parameters[model.structure->joints[0].geometry + 4] = 0.5;  // too short: 0.5 + 1 < 2
  JointProjection projection;
  EXPECT_FALSE(projection.Project(model, state.pose, &state));
  EXPECT_GT(projection.error(), 0.1);
  EXPECT_GE(projection.worst_joint(), 0);
}

// Where positions round to more than the tolerance joints hold to that.
TEST(JointProjectionTest, FarFromTheOriginJointsHoldToRounding) {
  const Scene scene =
      test_scenes::SceneOf(test_scenes::HeavyEnd("1", R"("dt": 0.01, "duration": 0.5)"));
  for (const double x : {1e5, 1e6, 1e8}) {
    Model<double> model;
    State<double> state;
    BuildModel(test_scenes::Rescaled(scene, {1.0, 1.0, {x, x}}), &model, &state);
    State<double> final;
    const RolloutReport report = Rollout(model, state, {}, &final);
    EXPECT_EQ(report.status, StepStatus::kDone) << x << ": " << report.message;
    EXPECT_LE(JointDrift(model, final), 1e-10 + kCoordinateRounding * x);
  }
}

// Anchors so far away that the first matrix cannot be factorised: no step was there to try.
TEST(JointProjectionTest, ArmsBeyondAllMeasureAreReported) {
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "a", "mass": 0.8, "inertia": 0.01, "position": [0, -0.2], "angle": -1.57},
      {"name": "b", "mass": 0.4, "inertia": 0.01, "position": [0, -0.55], "angle": -1.57}],
    "joints": [{"name": "j", "type": "revolute", "bodies": ["a", "world"], "anchor": [1e20, 0],
                "angle": 1.2, "rate": 0.5},
               {"name": "k", "type": "revolute", "bodies": ["b", "a"], "anchor": [0, -0.4],
                "angle": -0.4, "rate": 1}],
    "simulation": {"dt": 0.002, "duration": 0.01, "joint_correction": "projection"}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  State<double> final;
  const RolloutReport report = Rollout(model, state, {}, &final);
  EXPECT_NE(report.status, StepStatus::kDone);
  EXPECT_NE(report.message, "");
  for (const double x : final.pose) EXPECT_TRUE(std::isfinite(x));
}

}  // namespace
}  // namespace tangible
