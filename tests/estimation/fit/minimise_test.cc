// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/minimise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "../../support/block_problem.h"
#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// A minimum with its residuals, and their derivatives by the free parameters.
struct End : Minimum {
  Eigen::VectorXd residuals;
  RowMatrixXd jacobian;
};

End MinimiseFrom(const std::vector<FitParameter>& parameters, const FitOptions& options,
                 const std::vector<Observation>& observations, int* reports) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals = MakeResiduals(scene, {}, parameters, observations);
  End end;
  static_cast<Minimum&>(end) = Minimise(
      options, residuals.scene().Initial(), [] { return 1.0; },
      [reports](int iteration, const FitIteration&) { EXPECT_EQ(iteration, (*reports)++); },
      &residuals);
  EXPECT_TRUE(
      residuals.Evaluate(end.parameters, options.derivatives, &end.residuals, &end.jacobian));
  return end;
}

TEST(MinimiseTest, EndsAtTheMinimumAndReportsEveryIteration) {
  int reports = 0;
  const End minimum = MinimiseFrom({Parameter("gravity/y", -5.0)}, {},
                                   Observe(MakeScene(kFallingBall), 5, 0.01, 1), &reports);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_EQ(reports, static_cast<int>(minimum.iterations.size()));
  EXPECT_EQ(minimum.iterations.front().parameters, std::vector<double>{-5.0});
  EXPECT_EQ(minimum.iterations.back().cost, minimum.cost);
  EXPECT_EQ(minimum.iterations.back().parameters[0], minimum.parameters[0]);
  EXPECT_DOUBLE_EQ(0.5 * minimum.residuals.squaredNorm(), minimum.cost);
  // Jᵀ r = 0, to rounding of its terms.
  const double gradient = minimum.jacobian.col(0).dot(minimum.residuals);
  const double terms = minimum.jacobian.col(0).cwiseAbs().dot(minimum.residuals.cwiseAbs());
  EXPECT_LT(std::abs(gradient), 1e-10 * terms);
}

TEST(MinimiseTest, AParameterThatIsPushedOutStaysAtItsBound) {
  FitParameter damping = Parameter("bodies/ball/linear_damping", 0.5);
  damping.lower = 0.4;  // the truth is 0.3
  int reports = 0;
  const End minimum = MinimiseFrom({damping, Parameter("gravity/y", -8.0)}, {},
                                   Observe(MakeScene(kFallingBall), 5, 0.0, 1), &reports);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_DOUBLE_EQ(minimum.parameters[0], 0.4);
  EXPECT_LT(std::abs(minimum.jacobian.col(1).dot(minimum.residuals)),
            1e-8 * minimum.jacobian.col(1).cwiseAbs().dot(minimum.residuals.cwiseAbs()));
  damping.lower = 0.35;  // the cost falls beyond the bound
  reports = 0;
  const End wider = MinimiseFrom({damping, Parameter("gravity/y", -8.0)}, {},
                                 Observe(MakeScene(kFallingBall), 5, 0.0, 1), &reports);
  EXPECT_LT(wider.cost, 0.5 * minimum.cost);
}

TEST(MinimiseTest, TheLimitOfIterationsIsKept) {
  FitOptions options;
  options.max_iterations = 2;
  int reports = 0;
  const End minimum =
      MinimiseFrom({Parameter("gravity/y", -5.0), Parameter("bodies/ball/linear_damping", 3.0)},
                   options, Observe(MakeScene(kFallingBall), 5, 0.01, 1), &reports);
  EXPECT_EQ(minimum.status, FitStatus::kNotConverged);
  EXPECT_EQ(minimum.iterations.size(), 3u);
  EXPECT_EQ(minimum.message, "the limit of 2 iterations is reached before the minimum");
}

/// A problem of one parameter with one residual, and the values at which it was evaluated.
class OneResidual : public LeastSquaresProblem {
 public:
  /// Returns the residual and its derivative.
  using Function = std::pair<double, double> (*)(double);
  OneResidual(double initial, bool logarithmic, Function function) : function_(function) {
    entries_ = {{"x", initial, -kInfinity, kInfinity, logarithmic, 1.0}};
  }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 1; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return 1; }
  std::vector<RowPlace> Places(int /*block*/) const override { return {{0, 0.0}}; }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    seen.push_back(p[0]);
    const auto [residual, derivative] = function_(p[0]);
    evaluation->residuals = Eigen::VectorXd::Constant(1, residual);
    evaluation->jacobian = RowMatrixXd::Constant(1, 1, derivative);
    return true;
  }
  std::vector<double> seen;

 private:
  Function function_;
  std::vector<ParameterEntry> entries_;
};

// From 4 the first step leads beyond 0, where the cost is less and nothing has an effect.
TEST(MinimiseTest, AStepToWhereNothingHasAnEffectIsTakenBack) {
  OneResidual problem(4.0, false, [](double x) {
    const double root = std::sqrt(std::max(x + 0.01, 0.0));
    return root > 0.0 ? std::pair(10.0 * root - 2.0, 5.0 / root) : std::pair(5.0, 0.0);
  });
  const Minimum minimum = Minimise(
      {}, Eigen::VectorXd::Constant(1, 4.0), [] { return 0.0; }, {}, &problem);
  EXPECT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_NEAR(minimum.parameters[0], 0.03, 1e-9);
}

TEST(MinimiseTest, WhereNothingHasAnEffectIsNoMinimum) {
  OneResidual problem(1.0, false, [](double) { return std::pair(5.0, 0.0); });
  const Minimum minimum = Minimise(
      {}, Eigen::VectorXd::Constant(1, 1.0), [] { return 0.0; }, {}, &problem);
  EXPECT_EQ(minimum.status, FitStatus::kNotConverged);
  EXPECT_NE(minimum.message.find("no parameter has an effect"), std::string::npos)
      << minimum.message;
}

/// r = (x, −1 + 0.45 x²) / σ, whose minimum is far from zero: near x = 0 a Gauss-Newton step goes a
/// tenth of the way to it.
class FarFromZero : public LeastSquaresProblem {
 public:
  FarFromZero() { entries_ = {{"x", 0.4, -10.0, 10.0, false, 1.0}}; }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 1; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return 2; }
  std::vector<RowPlace> Places(int /*block*/) const override { return {{0, 0.0}, {0, 1.0}}; }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    evaluation->residuals = 1e3 * Eigen::Vector2d(p[0], -1.0 + 0.45 * p[0] * p[0]);
    evaluation->jacobian = 1e3 * Eigen::Vector2d(1.0, 0.9 * p[0]);
    return true;
  }

 private:
  std::vector<ParameterEntry> entries_;
};

TEST(MinimiseTest, AConvergenceByAConstantFactorIsAccelerated) {
  FarFromZero problem;
  const Minimum minimum = Minimise(
      {}, Eigen::VectorXd::Constant(1, 0.4), [] { return 0.0; }, {}, &problem);
  EXPECT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_NEAR(minimum.parameters[0], 0.0, 1e-6);
  // Steps that each leave 0.9 of the way would take 130 to get there.
  EXPECT_LT(minimum.iterations.size(), 25U);
}

TEST(MinimiseTest, GivesUpWhereTheFirstIterationsGainLittle) {
  FarFromZero problem;
  const Minimum minimum = Minimise({}, Eigen::VectorXd::Constant(1, 0.4), [] { return 0.0; }, {},
                                   &problem, nullptr, {2, 0.1});
  EXPECT_EQ(minimum.status, FitStatus::kNotConverged);
  EXPECT_TRUE(minimum.gave_up);
  EXPECT_EQ(minimum.iterations.size(), 3U);
}

TEST(MinimiseTest, AStartThatCannotBeRunFails) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("bodies/ball/mass", 1.0), Parameter("gravity/y", -9.0)},
                    Observe(scene, 10, 0.0, 1));
  Eigen::VectorXd start(2);
  start << 1.0, 1e308;
  const Minimum minimum = Minimise(
      {}, start, [] { return 0.0; }, [](int, const FitIteration&) {}, &residuals);
  EXPECT_EQ(minimum.status, FitStatus::kFailed);
  EXPECT_EQ(minimum.message.rfind("the run at the initial values fails: ", 0), 0u)
      << minimum.message;
}

Minimum MinimiseBlocks(const FitOptions& options, LeastSquaresProblem* problem) {
  return Minimise(
      options, InitialOf(problem->entries()), [] { return 0.0; }, {}, problem);
}

TEST(MinimiseTest, ManyRecordingsShareParameters) {
  DecayProblem problem(20, 1);
  problem.prior_sigma = 1e6;
  const Minimum minimum = MinimiseBlocks({}, &problem);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  // 600 residuals, with 22 parameters fitted to them: 1/2 (600 − 22), ± sqrt(578 / 2).
  EXPECT_NEAR(minimum.cost, 289.0, 5.0 * 17.0);
  EXPECT_NEAR(minimum.parameters[0], DecayProblem::kRate, 0.02);
  EXPECT_NEAR(minimum.parameters[1], DecayProblem::kOffset, 0.02);
  for (int b = 0; b < 20; ++b) {
    EXPECT_NEAR(minimum.parameters[2 + b], DecayProblem::Amplitude(b), 0.05);
  }
  // The same from elsewhere, to rounding, and with other numbers of threads, in every bit.
  DecayProblem other(20, 1);
  other.prior_sigma = 1e6;
  for (ParameterEntry& entry : other.mutable_entries()) {
    entry.initial *= 0.5;
  }
  const Minimum again = MinimiseBlocks({}, &other);
  EXPECT_LT((again.parameters - minimum.parameters).cwiseAbs().maxCoeff(), 1e-12);
  FitOptions options;
  options.threads = 4;
  EXPECT_EQ(MinimiseBlocks(options, &problem).parameters, minimum.parameters);
}

// Time grows with the number of recordings and not with its cube.
TEST(MinimiseTest, HundredsOfRecordingsAreEliminatedOneByOne) {
  DecayProblem problem(600, 1, 10);
  const Minimum minimum = MinimiseBlocks({}, &problem);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_NEAR(minimum.parameters[0], DecayProblem::kRate, 0.01);
  EXPECT_NEAR(minimum.parameters[601], DecayProblem::Amplitude(599), 0.1);
}

// A weight is as many copies of the recording; a prior of great weight holds its parameter.
TEST(MinimiseTest, WeightsAndPriorsCount) {
  DecayProblem doubled(2, 5);
  doubled.observed()[1] = doubled.observed()[0];
  DecayProblem weighted(1, 5);
  weighted.weights = {2.0};
  const Minimum a = MinimiseBlocks({}, &doubled);
  const Minimum b = MinimiseBlocks({}, &weighted);
  EXPECT_NEAR(a.parameters[0], b.parameters[0], 1e-12);
  EXPECT_NEAR(a.cost, b.cost, 1e-10 * a.cost);
  DecayProblem held(2, 5);
  held.prior_sigma = 1e-9;
  EXPECT_NEAR(MinimiseBlocks({}, &held).parameters[0], DecayProblem::kRate, 1e-9);
  EXPECT_GT(std::abs(a.parameters[0] - DecayProblem::kRate), 1e-6);
}

// Outliers do not pull, and priors are never taken as such.
TEST(MinimiseTest, TheRobustLossIsForObservationsAlone) {
  DecayProblem problem(5, 2);
  for (Eigen::VectorXd& observed : problem.observed()) {
    observed[3] += 1.0;
  }
  FitOptions options;
  options.huber = 1.5;
  const Minimum robust = MinimiseBlocks(options, &problem);
  ASSERT_EQ(robust.status, FitStatus::kConverged) << robust.message;
  EXPECT_NEAR(robust.parameters[0], DecayProblem::kRate, 0.03);
  EXPECT_GT(std::abs(MinimiseBlocks({}, &problem).parameters[0] - DecayProblem::kRate), 0.03);
  // Far from the prior a linear loss would let k go.
  for (Eigen::VectorXd& observed : problem.observed()) {
    observed.setConstant(DecayProblem::kOffset);
  }
  problem.prior_sigma = 1e-4;
  EXPECT_NEAR(MinimiseBlocks(options, &problem).parameters[0], DecayProblem::kRate, 1e-3);
}

TEST(MinimiseTest, OwnParametersAtTheirBoundsStayThere) {
  DecayProblem problem(4, 1);
  problem.mutable_entries()[3].upper = 1.05;  // the truth is 1.1
  const Minimum minimum = MinimiseBlocks({}, &problem);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  EXPECT_DOUBLE_EQ(minimum.parameters[3], 1.05);
  EXPECT_NEAR(minimum.parameters[2], 1.0, 0.05);
  // All shared ones constant, and nothing free at all.
  for (int k : {0, 1}) {
    ParameterEntry& entry = problem.mutable_entries()[k];
    entry.lower = entry.initial = k == 0 ? 20.0 : 3.0;
    entry.upper = 100.0;
  }
  const Minimum held = MinimiseBlocks({}, &problem);
  EXPECT_EQ(held.status, FitStatus::kConverged) << held.message;
  EXPECT_DOUBLE_EQ(held.parameters[0], 20.0);
  EXPECT_DOUBLE_EQ(held.parameters[1], 3.0);
}

/// One block with the two parameters x ≥ 0 and y and the residuals that `function` gives.
class TwoParameters : public LeastSquaresProblem {
 public:
  using Function = std::function<void(double x, double y, Eigen::VectorXd* r, RowMatrixXd* j)>;
  TwoParameters(int rows, Eigen::Vector2d start, Function function)
      : rows_(rows), function_(std::move(function)) {
    entries_ = {{"x", start[0], 0.0, HUGE_VAL, false, 1.0},
                {"y", start[1], -HUGE_VAL, HUGE_VAL, false, 1.0}};
  }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 2; }
  int num_blocks() const override { return 1; }
  int num_own(int) const override { return 0; }
  int num_rows(int) const override { return rows_; }
  std::vector<RowPlace> Places(int) const override {
    return std::vector<RowPlace>(static_cast<size_t>(rows_));
  }
  bool EvaluateBlock(int, const Eigen::VectorXd& p, GradientMethod, BlockDerivatives,
                     BlockEvaluation* evaluation) override {
    evaluation->residuals.resize(rows_);
    evaluation->jacobian.resize(rows_, 2);
    function_(p[0], p[1], &evaluation->residuals, &evaluation->jacobian);
    return true;
  }

 private:
  int rows_;
  Function function_;
  std::vector<ParameterEntry> entries_;
};

// While y < 0 the cost falls beyond x = 0, so that x is held there; at y = 2 it falls inwards.
TEST(MinimiseTest, AParameterThatIsReleasedMovesInside) {
  TwoParameters problem(2, {1.0, -4.0}, [](double x, double y, Eigen::VectorXd* r, RowMatrixXd* j) {
    *r = Eigen::Vector2d(x - y, 10.0 * (std::exp(-y) - std::exp(-2.0)));
    *j << 1.0, -1.0, 0.0, -10.0 * std::exp(-y);
  });
  const Minimum minimum = MinimiseBlocks({}, &problem);
  ASSERT_EQ(minimum.status, FitStatus::kConverged) << minimum.message;
  int at_bound = 0;
  for (const FitIteration& iteration : minimum.iterations) {
    at_bound += iteration.parameters[0] == 0.0 ? 1 : 0;
  }
  EXPECT_GE(at_bound, 2) << "it was not held";
  EXPECT_NEAR(minimum.parameters[0], 2.0, 1e-9);
  EXPECT_NEAR(minimum.parameters[1], 2.0, 1e-9);
}

// Derivatives of another function: no step lowers the cost, and a large one is left.
TEST(MinimiseTest, AStepThatIsLeftIsNotCalledConverged) {
  TwoParameters problem(3, {1.0, 1.0}, [](double x, double y, Eigen::VectorXd* r, RowMatrixXd* j) {
    *r = Eigen::Vector3d(x - 0.5, y - 1.0, 2.0);
    *j << -1.0, 0.0, 0.0, 1.0, 0.0, 0.0;
  });
  const Minimum minimum = MinimiseBlocks({}, &problem);
  EXPECT_EQ(minimum.status, FitStatus::kNotConverged);
  EXPECT_NE(minimum.message.find("standard deviations is left, and a gradient of"),
            std::string::npos)
      << minimum.message;
  EXPECT_NE(minimum.message.find("along 'x'"), std::string::npos) << minimum.message;
}

TEST(SetInternalBoundsTest, MovesTheStartWithinTheBounds) {
  FitParameter gravity = Parameter("gravity/y", -9.0);
  gravity.lower = -10.0;
  gravity.upper = -8.0;
  const Scene scene = MakeScene(kFallingBall);
  const RolloutResiduals residuals =
      MakeResiduals(scene, {}, {gravity}, Observe(scene, 10, 0.0, 1));
  Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 1e9);
  ceres::Problem problem;
  problem.AddParameterBlock(x.data(), 1);
  SetInternalBounds(residuals.entries(), 0, 1, &problem, x.data());
  EXPECT_NEAR(ToParameters(residuals.entries(), x)[0], -8.0, 1e-12);
  EXPECT_EQ(problem.GetParameterUpperBound(x.data(), 0), x[0]);
  EXPECT_LT(problem.GetParameterLowerBound(x.data(), 0), x[0]);
}

}  // namespace
}  // namespace tangible
