// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/linearisation.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <barrier>
#include <thread>

#include "../../support/block_problem.h"
#include "../../support/random_matrix.h"
#include "tangible/math/shared_work.h"

namespace tangible {
namespace {

TEST(RobustCostTest, IsQuadraticWithinTheBoundAndLinearBeyond) {
  const Eigen::Vector3d r(0.5, -2.0, 10.0);
  EXPECT_DOUBLE_EQ(RobustCost(r, 0.0), 0.5 * (0.25 + 4.0 + 100.0));
  // 2 b |r| − b² beyond b = 2.
  EXPECT_DOUBLE_EQ(RobustCost(r, 2.0), 0.5 * (0.25 + 4.0 + 2.0 * 2.0 * 10.0 - 4.0));
}

/// 200 rows, so that several chunks are gathered; the last 20 are priors.
BlockEvaluation RandomBlock() {
  BlockEvaluation block;
  block.residuals = 4.0 * testing::RandomMatrix(200, 1, 1);
  block.jacobian = testing::RandomMatrix(200, 3, 2);
  return block;
}

TEST(ReduceTest, TheFactorStandsForTheRows) {
  const BlockEvaluation block = RandomBlock();
  const Eigen::Vector3d q_scale(1.0, 10.0, 0.1);
  const double weight = 0.7;
  const double huber = 1.5;
  const BlockFactor factor = Reduce(block, q_scale, 1, 180, weight, huber);
  ASSERT_EQ(factor.factor.rows(), 4);
  const double cost = weight * (RobustCost(block.residuals.head(180), huber) +
                                RobustCost(block.residuals.tail(20), 0.0));
  EXPECT_NEAR(0.5 * factor.residuals().squaredNorm() + 0.5 * std::pow(factor.remainder, 2), cost,
              1e-13 * cost);
  Eigen::VectorXd pull = weight * block.residuals;
  RowMatrixXd curved = std::sqrt(weight) * block.jacobian * q_scale.asDiagonal();
  for (int i = 0; i < 180; ++i) {
    pull[i] *= RobustWeight(block.residuals[i], huber);
    if (std::abs(block.residuals[i]) > huber) {
      curved.row(i).setZero();
    }
  }
  // Own parameters, the last of [shared | own], come first.
  const Eigen::Vector3d gradient = q_scale.asDiagonal() * (block.jacobian.transpose() * pull);
  const Eigen::Vector3d reduced = factor.jacobian().transpose() * factor.residuals();
  EXPECT_LT((reduced - Eigen::Vector3d(gradient[2], gradient[0], gradient[1])).norm(),
            1e-12 * gradient.norm());
  const Eigen::Matrix3d hessian = curved.transpose() * curved;
  const Eigen::Matrix3d of_factor = factor.curved.transpose() * factor.curved;
  EXPECT_NEAR(of_factor(0, 0), hessian(2, 2), 1e-12 * hessian.norm());
  EXPECT_NEAR(of_factor(1, 2), hessian(0, 1), 1e-12 * hessian.norm());
}

// A prior of one row is not turned into more rows than it has.
TEST(ReduceTest, FewRowsStayFew) {
  BlockEvaluation block;
  block.residuals = Eigen::VectorXd::Constant(1, 2.0);
  block.jacobian = RowMatrixXd::Constant(1, 3, 0.5);
  const BlockFactor factor = Reduce(block, Eigen::Vector3d::Ones(), 0, 0, 1.0, 1.0);
  EXPECT_EQ(factor.factor.rows(), 1);
  EXPECT_EQ(factor.curved.rows(), 1);  // a prior is never taken as linear
  EXPECT_EQ(factor.remainder, 0.0);
}

TEST(LinearizerTest, TheGradientIsThatOfTheCostAndTheBitsAreThoseOfOneThread) {
  DecayProblem problem(7, 1);
  const Eigen::VectorXd q = ToInternal(problem.entries(), 1.1 * InitialOf(problem.entries()));
  const HuberBounds huber{2.0, 1.0};
  Linearisation models[2][2];
  for (int i = 0; i < 2; ++i) {
    Linearizer linearizer(&problem, GradientMethod::kTangent, i == 0 ? 1 : 5, nullptr);
    ASSERT_TRUE(linearizer.Linearise(q, huber, &models[i][0], &models[i][1]));
    EXPECT_EQ(linearizer.rollouts(), problem.num_blocks());
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(models[0][i].cost, models[1][i].cost);
    EXPECT_EQ(models[0][i].gradient, models[1][i].gradient);
  }
  EXPECT_NE(models[0][0].cost, models[0][1].cost);
  Linearizer linearizer(&problem, GradientMethod::kTangent, 0, nullptr);
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    Eigen::VectorXd current[2];
    double target[2];
    const double h = 1e-6;
    for (int i = 0; i < 2; ++i) {
      Eigen::VectorXd moved = q;
      moved[k] += i == 0 ? -h : h;
      ASSERT_TRUE(linearizer.Cost(moved, huber, &current[i], &target[i]));
    }
    // Rounding of costs of order 1e4 over h.
    EXPECT_NEAR((current[1] - current[0]).sum() / (2.0 * h), models[0][0].gradient[k],
                1e-6 * models[0][0].gradient.norm());
    EXPECT_NEAR((target[1] - target[0]) / (2.0 * h), models[0][1].gradient[k],
                1e-6 * models[0][1].gradient.norm());
  }
}

TEST(LinearizerTest, TheFirstBlockThatFailsIsNamed) {
  DecayProblem problem(5, 1);
  problem.failing = {3, 1};
  Linearizer linearizer(&problem, GradientMethod::kTangent, 3, nullptr);
  std::vector<BlockEvaluation> blocks;
  EXPECT_FALSE(linearizer.Rows(InitialOf(problem.entries()), BlockDerivatives::kSkip, &blocks));
  EXPECT_EQ(linearizer.message(), "block 1: fails");
}

constexpr int kProcesses = 3;

/// Threads in the place of processes.
struct Exchanged {
  std::barrier<> all_here{kProcesses};
  std::array<std::string, kProcesses> sent;
};

class ThreadsWork : public SharedWork {
 public:
  ThreadsWork(Exchanged* exchanged, int rank) : exchanged_(*exchanged), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return kProcesses; }
  std::vector<std::string> Exchange(const std::string& own) override {
    exchanged_.sent[static_cast<size_t>(rank_)] = own;
    exchanged_.all_here.arrive_and_wait();
    std::vector<std::string> all(exchanged_.sent.begin(), exchanged_.sent.end());
    exchanged_.all_here.arrive_and_wait();
    return all;
  }

 private:
  Exchanged& exchanged_;
  const int rank_;
};

class CountedProblem : public DecayProblem {
 public:
  using DecayProblem::DecayProblem;
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
    ++evaluations;
    return DecayProblem::EvaluateBlock(block, p, method, derivatives, evaluation);
  }
  int evaluations = 0;
};

// Each process evaluates its share of the blocks, and all have the bits of one that evaluates all.
TEST(LinearizerTest, ProcessesDivideTheBlocks) {
  struct Result {
    Linearisation current, target;
    std::vector<BlockEvaluation> rows;
    std::string message;
    long rollouts = 0;
    int evaluations = 0;
  };
  const auto evaluate = [](Result* result) {
    CountedProblem problem(7, 1);
    const Eigen::VectorXd q = ToInternal(problem.entries(), 1.1 * InitialOf(problem.entries()));
    Linearizer linearizer(&problem, GradientMethod::kTangent, 1, nullptr);
    EXPECT_TRUE(linearizer.Linearise(q, {2.0, 1.0}, &result->current, &result->target));
    EXPECT_TRUE(
        linearizer.Rows(InitialOf(problem.entries()), BlockDerivatives::kCompute, &result->rows));
    result->rollouts = linearizer.rollouts();
    result->evaluations = problem.evaluations;
    problem.failing = {6, 4};
    EXPECT_FALSE(linearizer.Linearise(q, {2.0, 1.0}, &result->current, &result->target));
    result->message = linearizer.message();
  };
  Result alone;
  evaluate(&alone);
  EXPECT_EQ(alone.evaluations, 2 * 8);
  Exchanged exchanged;
  std::array<Result, kProcesses> results;
  std::vector<std::thread> threads;
  for (int rank = 0; rank < kProcesses; ++rank) {
    threads.emplace_back([&, rank] {
      ThreadsWork work(&exchanged, rank);
      const SharedWork::Scope scope(&work);
      evaluate(&results[static_cast<size_t>(rank)]);
    });
  }
  for (std::thread& thread : threads) thread.join();
  int evaluations = 0;
  for (const Result& result : results) {
    // Seven blocks of 30 rows and one of a single row.
    EXPECT_GE(result.evaluations, 2 * 2);
    EXPECT_LE(result.evaluations, 2 * 3);
    evaluations += result.evaluations;
    EXPECT_EQ(result.rollouts, alone.rollouts);
    EXPECT_EQ(result.current.cost, alone.current.cost);
    EXPECT_EQ(result.target.gradient, alone.target.gradient);
    ASSERT_EQ(result.rows.size(), alone.rows.size());
    for (size_t block = 0; block < alone.rows.size(); ++block) {
      EXPECT_EQ(result.rows[block].residuals, alone.rows[block].residuals);
      EXPECT_EQ(result.rows[block].jacobian, alone.rows[block].jacobian);
    }
    EXPECT_EQ(result.message, "block 4: fails");
  }
  EXPECT_EQ(evaluations, alone.evaluations);
}

// The square of a residual may be beyond a double where the residual is not.
TEST(LinearizerTest, ACostThatIsNotFiniteIsAFailure) {
  DecayProblem problem(2, 1);
  problem.observed()[1][3] = 1e200;
  Linearizer linearizer(&problem, GradientMethod::kTangent, 1, nullptr);
  const Eigen::VectorXd q = ToInternal(problem.entries(), InitialOf(problem.entries()));
  Linearisation model;
  Linearisation target;
  EXPECT_FALSE(linearizer.Linearise(q, {0.0, 0.0}, &model, &target));
  EXPECT_EQ(linearizer.message(),
            "the cost is not finite: an observation, a prior or a sigma is beyond all bounds");
  // Huber's loss is linear there.
  EXPECT_TRUE(linearizer.Linearise(q, {3.0, 3.0}, &model, &target));
}

TEST(ForEachOnThreadsTest, EachIsDoneOnce) {
  std::vector<std::atomic<int>> counts(100);
  ForEachOnThreads(4, 100, [&](int i) { ++counts[i]; });
  for (const std::atomic<int>& count : counts) {
    EXPECT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace tangible
