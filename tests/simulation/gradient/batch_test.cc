// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../support/scenes.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

std::vector<ParameterPath> Paths(const Scene& scene, const std::vector<std::string>& paths) {
  std::vector<ParameterPath> parameters(paths.size());
  std::string error;
  for (size_t i = 0; i < paths.size(); ++i) {
    EXPECT_TRUE(ResolveParameter(scene, paths[i], &parameters[i], &error)) << error;
  }
  return parameters;
}

// Rows about the scene's own values, each column by up to a tenth.
RowMatrixXd RowsAbout(const std::vector<ParameterPath>& parameters, int rows) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> about(0.9, 1.1);
  RowMatrixXd values(rows, static_cast<Eigen::Index>(parameters.size()));
  for (int r = 0; r < rows; ++r) {
    for (size_t k = 0; k < parameters.size(); ++k) {
      values(r, static_cast<Eigen::Index>(k)) = parameters[k].value * about(random);
    }
  }
  return values;
}

Scene MixtureOf(Stepping stepping) {
  Scene scene = SceneOf(test_scenes::Mixture());
  scene.simulation.stepping = stepping;
  return scene;
}

class BatchTest : public ::testing::TestWithParam<Stepping> {
 protected:
  Scene scene_ = MixtureOf(GetParam());
  // Radii and masses: what a stepper might keep from row to row.
  std::vector<ParameterPath> parameters_ =
      Paths(scene_, {"bodies/ball/shape/radius", "bodies/*/mass", "bodies/crate/velocity/x",
                     "bodies/floor/friction"});
  RowMatrixXd values_ = RowsAbout(parameters_, 9);
};

INSTANTIATE_TEST_SUITE_P(Stepping, BatchTest, ::testing::Values(Stepping::kFixed, Stepping::kEvent),
                         [](const auto& info) {
                           return info.param == Stepping::kFixed ? "Fixed" : "Event";
                         });

TEST_P(BatchTest, RowsHaveTheBitsOfSingleRunsWithAnyNumberOfThreads) {
  for (const int threads : {0, 1, 2, 3, 40}) {
    const BatchResult batch = RunBatch(scene_, parameters_, values_, {.threads = threads});
    ASSERT_EQ(batch.message, "");
    ASSERT_EQ(batch.rows.size(), 9u);
    for (Eigen::Index r = 0; r < 9; ++r) {
      Scene scene = scene_;
      ASSERT_EQ(SetParameters(parameters_, values_.row(r).data(), &scene), "");
      Model<double> model;
      State<double> initial, final;
      BuildModel(scene, &model, &initial);
      const RolloutReport report = Rollout(model, initial, {}, &final);
      const BatchRow& row = batch.rows[static_cast<size_t>(r)];
      EXPECT_EQ(row.status, RolloutStatus::kDone) << row.message;
      EXPECT_TRUE(row.final == final) << r << " of " << threads << " threads";
      EXPECT_EQ(row.report.factorisations, report.factorisations);
      EXPECT_EQ(row.jacobian.size(), 0);
    }
    EXPECT_FALSE(batch.rows[0].final == batch.rows[1].final);
  }
}

// A turning bar of which a row has another length by factors: how far a contact is looked for
// follows the row's shape.
TEST_P(BatchTest, ShapesMayDifferByFactors) {
  Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "bar", "shape": {"box": {"size": [0.02, 0.02]}}, "mass": 1, "inertia": 0.01,
       "position": [0, 1], "angular_velocity": 30, "friction": 0.5, "restitution": 0.3}],
      "simulation": {"dt": 0.01, "duration": 0.7}})");
  scene.simulation.stepping = GetParam();
  const std::vector<ParameterPath> length = Paths(scene, {"bodies/bar/shape/size/x"});
  RowMatrixXd values(4, 1);
  values << 0.02, 0.2, 1.4, 0.1;
  const BatchResult batch = RunBatch(scene, length, values, {.threads = 1});
  ASSERT_EQ(batch.message, "");
  for (Eigen::Index r = 0; r < values.rows(); ++r) {
    Scene single = scene;
    ASSERT_EQ(SetParameters(length, values.row(r).data(), &single), "");
    Model<double> model;
    State<double> initial, final;
    BuildModel(single, &model, &initial);
    Rollout(model, initial, {}, &final);
    EXPECT_TRUE(batch.rows[static_cast<size_t>(r)].final == final) << values(r, 0);
  }
}

TEST_P(BatchTest, DerivativesHaveTheBitsOfSingleOnes) {
  const std::vector<LossTerm> loss = {{"ball/x", 0.3, 2.0}, {"crate/angle", -0.1, 1.0}};
  for (const auto& [derivative, method] :
       {std::pair{BatchDerivative::kTangent, GradientMethod::kTangent},
        std::pair{BatchDerivative::kAdjoint, GradientMethod::kAdjoint}}) {
    BatchOptions options{2, derivative, {}};
    const BatchResult jacobians = RunBatch(scene_, parameters_, values_, options);
    options.threads = 3;
    options.loss = loss;
    const BatchResult losses = RunBatch(scene_, parameters_, values_, options);
    for (const Eigen::Index r : {0, 8}) {
      Scene scene = scene_;
      ASSERT_EQ(SetParameters(parameters_, values_.row(r).data(), &scene), "");
      const GradientOptions single{.method = method, .certificate = CertificatePass::kSkip};
      const BatchRow& row = jacobians.rows[static_cast<size_t>(r)];
      EXPECT_EQ(row.jacobian, FinalStateJacobian(scene, parameters_, single).jacobian);
      EXPECT_GT(row.jacobian.norm(), 0.1);
      EXPECT_EQ(row.gradient.size(), 0);
      const GradientResult gradient = LossGradient(scene, parameters_, loss, single);
      const BatchRow& of_loss = losses.rows[static_cast<size_t>(r)];
      EXPECT_EQ(of_loss.loss, gradient.loss);
      // Sums in another order: a few roundings of the largest entry.
      const double rounding = 1e-13 * gradient.gradient.cwiseAbs().maxCoeff();
      EXPECT_LE((of_loss.gradient - gradient.gradient).cwiseAbs().maxCoeff(), rounding);
      EXPECT_EQ(of_loss.jacobian.size(), 0);
    }
  }
}

TEST_P(BatchTest, AutoIsTheDerivativeThatItNames) {
  BatchOptions options{2, BatchDerivative::kAuto, {}};
  const BatchResult jacobians = RunBatch(scene_, parameters_, values_, options);
  EXPECT_EQ(jacobians.derivative, BatchDerivative::kTangent);
  options.derivative = BatchDerivative::kTangent;
  EXPECT_EQ(jacobians.rows[0].jacobian,
            RunBatch(scene_, parameters_, values_, options).rows[0].jacobian);
  options = {2, BatchDerivative::kAuto, {{"ball/x", 0.3, 2.0}}};
  const BatchResult losses = RunBatch(scene_, parameters_, values_, options);
  EXPECT_EQ(losses.derivative, BatchDerivative::kAdjoint);
  options.derivative = BatchDerivative::kAdjoint;
  EXPECT_EQ(losses.rows[0].gradient,
            RunBatch(scene_, parameters_, values_, options).rows[0].gradient);
}

// A row that is refused, one that cannot be solved and good ones around them.
TEST(BatchFailureTest, ARowThatFailsStopsNoOther) {
  // The clamp moves down onto a ball that stands on the floor: with a positive speed there is no
  // solution once they meet.
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5]},
      {"name": "clamp", "kinematic": true, "shape": {"box": {"size": [1, 0.2]}},
       "position": [0, 1.2], "velocity": [0, 0]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.5}})");
  const std::vector<ParameterPath> parameters =
      Paths(scene, {"bodies/ball/mass", "bodies/clamp/velocity/y"});
  RowMatrixXd values(5, 2);
  values << 1.0, 0.0, -1.0, 0.0, 2.0, -1.0, 2.0, 1.0, std::nan(""), 0.0;
  for (const BatchDerivative derivative :
       {BatchDerivative::kNone, BatchDerivative::kTangent, BatchDerivative::kAdjoint}) {
    for (const int threads : {1, 2}) {
      const BatchResult batch = RunBatch(scene, parameters, values, {threads, derivative, {}});
      ASSERT_EQ(batch.rows.size(), 5u);
      EXPECT_EQ(batch.rows[0].status, RolloutStatus::kDone) << batch.rows[0].message;
      EXPECT_EQ(batch.rows[1].status, RolloutStatus::kRefused);
      EXPECT_EQ(batch.rows[1].message, "bodies/ball/mass: expected a number > 0, got -1.0");
      EXPECT_EQ(batch.rows[1].report.steps, 0);
      EXPECT_EQ(batch.rows[1].final.pose[1], 0.5);
      EXPECT_EQ(batch.rows[2].status, RolloutStatus::kUnsolved);
      EXPECT_EQ(batch.rows[2].message.find("step 1"), 0u) << batch.rows[2].message;
      EXPECT_LT(batch.rows[2].report.time, 0.2);
      EXPECT_EQ(batch.rows[2].jacobian.size(), 0);
      EXPECT_EQ(batch.rows[3].status, RolloutStatus::kDone) << batch.rows[3].message;
      EXPECT_EQ(batch.rows[4].status, RolloutStatus::kRefused);
    }
  }
}

TEST(BatchFailureTest, WhatConcernsAllRowsIsSaidOnce) {
  Scene scene = SceneOf(test_scenes::Mixture());
  const std::vector<ParameterPath> twice = Paths(scene, {"bodies/*/mass", "bodies/ball/mass"});
  EXPECT_NE(RunBatch(scene, twice, RowMatrixXd(1, 2), {}).message.find("bodies/ball/mass"),
            std::string::npos);
  const std::vector<ParameterPath> mass = Paths(scene, {"bodies/ball/mass"});
  EXPECT_EQ(RunBatch(scene, mass, RowMatrixXd(1, 2), {}).message,
            "values: expected 1 columns, one a parameter, got 2");
  const BatchOptions unknown{1, BatchDerivative::kAdjoint, {{"bal/x", 0.0, 1.0}}};
  EXPECT_EQ(RunBatch(scene, mass, RowMatrixXd::Ones(1, 1), unknown).message,
            "output bal/x: no such output of the scene");
  scene.simulation.integrator = Integrator::kTrapezoidal;
  const BatchResult refused = RunBatch(scene, mass, RowMatrixXd::Ones(1, 1), {});
  EXPECT_EQ(refused.message.find("/simulation/integrator"), 0u);
  EXPECT_TRUE(refused.rows.empty());
}

TEST(BatchFailureTest, NoRowsAndNoParameters) {
  const Scene scene = SceneOf(test_scenes::Mixture());
  EXPECT_TRUE(RunBatch(scene, {}, RowMatrixXd(0, 0), {}).rows.empty());
  const BatchResult plain = RunBatch(scene, {}, RowMatrixXd(2, 0), {});
  ASSERT_EQ(plain.rows.size(), 2u);
  EXPECT_TRUE(plain.rows[0].final == plain.rows[1].final);
  long called = 0;
  RunBatch(scene, {}, RowMatrixXd(5, 0), {.threads = 2}, [&](long done) { called += done; });
  EXPECT_EQ(called, 1 + 2 + 3 + 4 + 5);
}

}  // namespace
}  // namespace tangible
