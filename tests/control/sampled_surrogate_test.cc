// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/sampled_surrogate.h"

#include <gtest/gtest.h>

#include <limits>

#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

// x⁺ = x + u³ where u is not beyond a limit, from which on no step can be made.
class Cubic : public StepMap {
 public:
  int num_states() const override { return 1; }
  int num_controls() const override { return 1; }
  bool Step(long, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override {
    *next = VectorX<double>::Constant(1, x[0] + u[0] * u[0] * u[0]);
    *error = "beyond the limit";
    return u[0] <= limit;
  }
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override {
    a->setIdentity(1, 1);
    *b = MatrixX<double>::Constant(1, 1, 3.0 * u[0] * u[0]);
    return Step(k, x, u, next, error);
  }
  double limit = std::numeric_limits<double>::infinity();
};

class SampledSurrogateTest : public ::testing::Test {
 protected:
  SampledSurrogateTest() : cost_(1, 1, 1.0, {}) {
    const VectorX<double> bound = VectorX<double>::Constant(1, 5.0);
    problem_ = {&map_, &cost_, VectorX<double>::Zero(1), -bound, bound};
    plan_.controls = RowMatrixXd::Constant(3, 1, 0.5);
    plan_.states = RowMatrixXd::Zero(4, 1);
  }
  // B of each step.
  std::vector<MatrixX<double>> Average(const SampledSurrogate& options) {
    std::vector<MatrixX<double>> a(3, MatrixX<double>::Identity(1, 1));
    std::vector<MatrixX<double>> b(3, MatrixX<double>::Constant(1, 1, 0.75));
    AverageJacobians(problem_, plan_, options, &a, &b);
    for (const MatrixX<double>& one : a) EXPECT_NEAR(one(0, 0), 1.0, 1e-15);
    return b;
  }

  Cubic map_;
  Cost cost_;
  ControlProblem problem_;
  Plan plan_;
};

TEST_F(SampledSurrogateTest, OfSmallDeviationsIsTheExactOne) {
  for (const MatrixX<double>& b : Average({.samples = 4, .deviation = 1e-9})) {
    EXPECT_NEAR(b(0, 0), 0.75, 1e-12);
  }
}

// The mean of 3 (ū + ε)² over pairs ±ε is 3 ū² + 3 mean ε², with ε normal of deviation 0.2.
TEST_F(SampledSurrogateTest, IsTheMeanOverNormalOffsetsOfAllSteps) {
  const std::vector<MatrixX<double>> b = Average({.samples = 4000, .deviation = 0.02});
  // The mean of 2000 squares scatters by √(2 / 2000) of itself.
  EXPECT_NEAR(b[0](0, 0) - 0.75, 3.0 * 0.04, 4.0 * 0.032 * 0.12);
  EXPECT_EQ(b[0], b[1]);
  EXPECT_EQ(b[0], b[2]);
  EXPECT_EQ(Average({.samples = 10, .seed = 3}), Average({.samples = 10, .seed = 3}));
  EXPECT_NE(Average({.samples = 10, .seed = 3}), Average({.samples = 10, .seed = 4}));
}

TEST_F(SampledSurrogateTest, LeavesOutStepsThatCannotBeMade) {
  map_.limit = 0.5;
  // Of each pair one sample is beyond the limit.
  for (const MatrixX<double>& b : Average({.samples = 100, .deviation = 0.01})) {
    EXPECT_LT(b(0, 0), 0.75);
  }
  map_.limit = -10.0;
  EXPECT_EQ(Average({.samples = 4})[2](0, 0), 0.75);
}

// A hammer that passes below a falling ball: the exact gradient of the ball's place is zero, and
// the plan stays; samples in which it is struck show the way.
TEST(SampledSurrogate, FindsAContactThatIsNotMade) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json", &scene, &error))
      << error;
  RolloutFunction function;
  ASSERT_EQ(function.Create(scene, {}, {"joints/slider/effort"}, {}), "");
  EngineStep map(function);
  std::vector<CostTerm> terms = {{CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, 1e-3, false}};
  for (const int axis : {0, 1}) {
    terms.push_back({CostTerm::Kind::kPoint, 6, axis, {0, 0}, axis == 0 ? 1.8 : 0.4, 100.0, true});
  }
  const Cost cost(12, 1, scene.simulation.dt, terms);
  const VectorX<double> bound = VectorX<double>::Constant(1, 30.0);
  const ControlProblem problem{&map, &cost, map.initial(), -bound, bound};
  const RowMatrixXd start = RowMatrixXd::Constant(function.num_steps(), 1, 4.0);
  const IlqrResult exact = SolveIlqr(problem, start, {.max_iterations = 30});
  EXPECT_EQ(exact.status, IlqrStatus::kConverged);
  EXPECT_EQ(exact.surrogate_iterations, 0);
  const IlqrResult sampled = SolveIlqr(
      problem, start, {.max_iterations = 30, .surrogate = {.samples = 8, .deviation = 0.05}});
  std::printf("cost %.3f, with the surrogate %.3f\n", exact.plan.cost, sampled.plan.cost);
  EXPECT_GT(exact.plan.cost, 100.0);
  EXPECT_LT(sampled.plan.cost, 0.2 * exact.plan.cost);
  EXPECT_GT(sampled.surrogate_iterations, 0);
  EXPECT_LE(sampled.surrogate_iterations, 15);
  EXPECT_LE(sampled.iterations.size(), 30U);
}

}  // namespace
}  // namespace tangible
