// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/projection_descent.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/drift.h"
#include "../../support/random_matrix.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/joint_projection.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// What is left of M (q − q̃) along directions in which the joints let the bodies move: those that
// K [d; ·] = [r; 0] has, per size of both in the metric of M.
double AlongJoints(const Model<double>& model, ProjectionIterate<double>* p) {
  const ModelStructure& s = *model.structure;
  EXPECT_TRUE(FactorProjection(model, p, ProjectionWeight::kMass));
  const auto mass = [&](int k, int i) {
    const BodyIndex& body = model.structure->bodies[s.moving[k]];
    return model.parameters[i < 2 ? body.mass : body.inertia];
  };
  RandomNumbers random(3);
  double largest = 0.0;
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<double> d(3 * (s.num_blocks() + s.joints.size()), 0.0);
    for (int k = 0; k < s.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        d[3 * k + i] = std::sqrt(mass(k, i)) * random.Uniform(-1.0, 1.0);
      }
    }
    p->lu.Solve(d.data(), 1);
    double product = 0.0, moves = 0.0, sizes = 0.0;
    for (int k = 0; k < s.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        const int q = 3 * s.moving[k] + i;
        const double moved = p->at.pose[q] - p->from.pose[q];
        product += mass(k, i) * moved * d[3 * k + i];
        moves += mass(k, i) * moved * moved;
        sizes += mass(k, i) * d[3 * k + i] * d[3 * k + i];
      }
    }
    largest = std::max(largest, std::abs(product) / std::sqrt(moves * sizes));
  }
  return largest;
}

TEST(ProjectionDescentTest, ReachesAMinimumWhereNewtonsMethodDoesNot) {
  Model<double> model;
  State<double> initial;
  BuildModel(test_scenes::SceneOf(test_scenes::HeavyEnd("1e9")), &model, &initial);
  RandomNumbers random(11);
  int failed = 0;
  for (int trial = 0; trial < 40; ++trial) {
    ProjectionIterate<double> p;
    p.from = initial;
    for (const int body : model.structure->moving) {
      for (int i = 0; i < 3; ++i) {
        p.from.pose[3 * body + i] += (i < 2 ? 0.2 : 4.0) * random.Uniform(-1.0, 1.0);
      }
    }
    p.at = p.from;
    if (IterateProjection(model, 0, &p)) {
      continue;
    }
    ++failed;
    ASSERT_TRUE(DescendToProjection(model, initial.pose, &p)) << trial << " " << p.error;
    EXPECT_LE(p.error, 1e-10);
    EXPECT_GT(p.damped_steps, 0);
    EXPECT_LT(AlongJoints(model, &p), 1e-6) << trial;
  }
  EXPECT_GT(failed, 5);
}

// The derivative at the minimum is that of Newton's matrix, however it was reached: tangent, the
// unrolled iteration in Jets, differences.
TEST(ProjectionDescentTest, DerivativesAreThoseOfTheMinimum) {
  Model<double> model;
  State<double> initial;
  BuildModel(test_scenes::SceneOf(test_scenes::HeavyEnd("1e4")), &model, &initial);
  const ModelStructure& s = *model.structure;
  RandomNumbers random(11);
  int compared = 0;
  for (int trial = 0; trial < 40; ++trial) {
    State<double> state = initial;
    for (const int body : s.moving) {
      for (int i = 0; i < 3; ++i) {
        state.pose[3 * body + i] += (i < 2 ? 0.2 : 4.0) * random.Uniform(-1.0, 1.0);
      }
    }
    ProjectionIterate<double> newton;
    newton.from = newton.at = state;
    if (IterateProjection(model, 0, &newton)) {
      continue;
    }
    RowMatrixXd w_dot = RowMatrixXd::Zero(s.num_variables(), 1);
    for (const int body : s.moving) {
      w_dot.middleRows(s.PoseVariable(body, 0), 3) = testing::RandomMatrix(3, 1, body);
    }
    const RowMatrixXd direction = w_dot;
    State<double> projected = state;
    JointProjection projection;
    ASSERT_TRUE(projection.Project(model, initial.pose, &projected)) << trial;
    projection.Tangent(model, w_dot.data(), 1);

    Model<Jet<4>> jets{model.structure, {}};
    for (const double number : model.parameters) {
      jets.parameters.emplace_back(number);
    }
    State<Jet<4>> jet;
    for (size_t i = 0; i < state.pose.size(); ++i) {
      jet.pose.emplace_back(state.pose[i]);
      jet.pose[i].v[0] = direction(static_cast<Eigen::Index>(i), 0);
      jet.twist.emplace_back(state.twist[i]);
    }
    JointProjection::ProjectUnrolled(jets, initial.pose, &jet);

    constexpr double kStep = 1e-7;
    State<double> sides[2] = {state, state};
    for (int side = 0; side < 2; ++side) {
      for (size_t i = 0; i < state.pose.size(); ++i) {
        sides[side].pose[i] +=
            (side == 0 ? -kStep : kStep) * direction(static_cast<Eigen::Index>(i), 0);
      }
      JointProjection other;
      ASSERT_TRUE(other.Project(model, initial.pose, &sides[side]));
    }
    double largest = 0.0, of_jets = 0.0, of_differences = 0.0;
    double apart = 0.0;
    for (size_t i = 0; i < state.pose.size(); ++i) {
      apart = std::max(apart, std::abs(sides[1].pose[i] - sides[0].pose[i]));
    }
    if (apart > 1e-3) {
      continue;  // at another minimum
    }
    for (const int body : s.moving) {
      for (int i = 3 * body; i < 3 * body + 3; ++i) {
        const double tangent = w_dot(s.PoseVariable(body, i - 3 * body), 0);
        largest = std::max(largest, std::abs(tangent));
        of_jets = std::max(of_jets, std::abs(jet.pose[i].v[0] - tangent));
        of_differences =
            std::max(of_differences,
                     std::abs((sides[1].pose[i] - sides[0].pose[i]) / (2.0 * kStep) - tangent));
      }
    }
    EXPECT_LT(of_jets, 1e-9 * largest) << trial;
    EXPECT_LT(of_differences, 1e-5 * largest) << trial;
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

TEST(ProjectionDescentTest, AStepThatSwingsAHeavyEndIsDone) {
  const testing::DriftOfRun run =
      testing::RunForDrift(test_scenes::SceneOf(test_scenes::HeavyEnd("1e9")));
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  EXPECT_LE(run.largest, 1e-10);
  EXPECT_GT(run.report.damped_projections, 0);
}

// A run that has diverged has no nearest poses: it fails at once and leaves the poses alone.
TEST(ProjectionDescentTest, FromPosesThatAreNotFiniteThereIsNone) {
  Model<double> model;
  State<double> initial;
  BuildModel(test_scenes::SceneOf(test_scenes::HeavyEnd("1e4")), &model, &initial);
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    ProjectionIterate<double> p;
    p.from = initial;
    p.from.pose[3 * model.structure->moving[1] + 1] = bad;
    p.at = p.from;
    EXPECT_FALSE(IterateProjection(model, 0, &p));
    EXPECT_FALSE(DescendToProjection(model, initial.pose, &p));
    State<double> state = initial;
    state.pose[3 * model.structure->moving[1] + 1] = bad;
    JointProjection projection;
    EXPECT_FALSE(projection.Project(model, initial.pose, &state));
    EXPECT_FALSE(std::isfinite(state.pose[3 * model.structure->moving[1] + 1]));
  }
}

}  // namespace
}  // namespace tangible
