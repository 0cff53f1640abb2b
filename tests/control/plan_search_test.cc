// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/plan_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

// The problem of data/control/struck_ball_into_cup.json.
class PlanSearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Scene scene;
    std::string error;
    ASSERT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json", &scene, &error));
    ASSERT_EQ(function_.Create(scene, {}, {"joints/slider/effort"}, {}), "");
    const std::vector<std::string> names = OutputNames(function_.structure());
    const auto ball =
        static_cast<int>(std::find(names.begin(), names.end(), "ball/x") - names.begin());
    using Kind = CostTerm::Kind;
    const std::vector<CostTerm> terms = {{Kind::kControl, 0, 0, {0, 0}, 0.0, 1e-3, false},
                                         {Kind::kPoint, ball, 0, {0, 0}, 1.8, 100.0, true},
                                         {Kind::kPoint, ball, 1, {0, 0}, 0.4, 100.0, true}};
    cost_ = std::make_unique<Cost>(function_.num_states(), 1, scene.simulation.dt, terms);
    const VectorX<double> bound = VectorX<double>::Constant(1, 30.0);
    problem_ = {&function_, cost_.get(), -bound, bound};
  }

  RowMatrixXd Held(double effort) const {
    return RowMatrixXd::Constant(function_.num_steps(), 1, effort);
  }

  RolloutFunction function_;
  std::unique_ptr<Cost> cost_;
  SearchProblem problem_;
};

// One start is the optimiser's plan, bit for bit.
TEST_F(PlanSearchTest, OneStartIsThePlanFromTheInitialControls) {
  SearchOptions options;
  options.ilqr.max_iterations = 8;
  const SearchResult found = SearchPlan(problem_, Held(6.5), options);
  EngineStep map(function_);
  const IlqrResult plain = SolveIlqr(
      {&map, cost_.get(), map.initial(), problem_.low, problem_.high}, Held(6.5), options.ilqr);
  EXPECT_EQ(found.best.plan.controls, plain.plan.controls);
  EXPECT_EQ(found.best.plan.cost, plain.plan.cost);
  EXPECT_EQ(found.best.rollouts, plain.rollouts);
  EXPECT_EQ(found.drawn, 0);
  EXPECT_EQ(found.chosen, 0);
  EXPECT_EQ(found.polished_costs, std::vector<double>{plain.plan.cost});
}

// 0.5 N miss the ball, and the exact gradient cannot know of it: its plan does nothing. Draws and
// samples strike, and the cup is reached.
TEST_F(PlanSearchTest, StartsAndSamplesFindABallThatIsMissed) {
  SearchOptions options;
  options.ilqr.max_iterations = 40;
  const double missed = SearchPlan(problem_, Held(0.5), options).best.plan.cost;
  EXPECT_GT(missed, 50.0);
  options.starts.count = 6;
  const SearchResult starts = SearchPlan(problem_, Held(0.5), options);
  ASSERT_EQ(starts.start_costs.size(), 6U);
  EXPECT_GT(starts.chosen, 0);
  EXPECT_EQ(starts.best.plan.cost,
            *std::min_element(starts.polished_costs.begin(), starts.polished_costs.end()));
  for (size_t i = 0; i < 6; ++i) EXPECT_LE(starts.polished_costs[i], starts.start_costs[i]) << i;
  EXPECT_LT(starts.best.plan.cost, 0.05);
  options.starts.count = 1;
  for (const SamplingMethod method : {SamplingMethod::kCrossEntropy, SamplingMethod::kMppi}) {
    options.sampling = {.method = method, .samples = 48, .iterations = 5, .seed = 3};
    const SearchResult sampled = SearchPlan(problem_, Held(0.5), options);
    EXPECT_EQ(sampled.drawn, 5 * 48);
    EXPECT_LT(sampled.start_costs[0], 0.2 * missed) << NameOf(method);
    EXPECT_LT(sampled.best.plan.cost, 1.0) << NameOf(method);
  }
}

TEST_F(PlanSearchTest, BitsDoNotDependOnThreadsAndDoOnSeeds) {
  SearchOptions options;
  options.ilqr.max_iterations = 10;
  options.starts = {.count = 4, .pieces = 5, .seed = 7};
  options.sampling = {.method = SamplingMethod::kMppi, .samples = 10, .iterations = 2, .seed = 1};
  options.threads = 1;
  const SearchResult one = SearchPlan(problem_, Held(2.0), options);
  options.threads = 3;
  const SearchResult three = SearchPlan(problem_, Held(2.0), options);
  EXPECT_EQ(one.best.plan.controls, three.best.plan.controls);
  EXPECT_EQ(one.best.rollouts, three.best.rollouts);
  EXPECT_EQ(one.start_costs, three.start_costs);
  EXPECT_EQ(one.polished_costs, three.polished_costs);
  options.starts.seed = 8;
  EXPECT_NE(SearchPlan(problem_, Held(2.0), options).start_costs, one.start_costs);
  options.starts.seed = 7;
  options.sampling.seed = 2;
  EXPECT_NE(SearchPlan(problem_, Held(2.0), options).start_costs, one.start_costs);
}

// A held effort is drawn at random in each piece: no more pieces than steps.
TEST_F(PlanSearchTest, PiecesMayBeMoreThanSteps) {
  SearchOptions options;
  options.ilqr.max_iterations = 1;
  options.starts = {.count = 2, .pieces = 1000};
  options.sampling = {.samples = 2, .iterations = 1};
  EXPECT_NE(SearchPlan(problem_, Held(2.0), options).best.status, IlqrStatus::kFailed);
}

TEST_F(PlanSearchTest, WithoutBoundsNothingIsDrawn) {
  problem_.high[0] = HUGE_VAL;
  SearchOptions options;
  options.ilqr.max_iterations = 1;
  EXPECT_NE(SearchPlan(problem_, Held(2.0), options).best.status, IlqrStatus::kFailed);
  options.starts.count = 2;
  const SearchResult found = SearchPlan(problem_, Held(2.0), options);
  EXPECT_EQ(found.best.status, IlqrStatus::kFailed);
  EXPECT_EQ(found.best.message,
            "bounds of control 0: expected finite ones, between which starts are drawn, got none");
}

}  // namespace
}  // namespace tangible
