// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/evaluation_log.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tangible {
namespace {

/// r = x², J = 2 x, of one unknown; fails below 0, and counts its calls.
struct Square {
  explicit Square(EvaluationLog* kept) : log(kept) {}
  EvaluationLog* log;
  int calls = 0;
  long rollouts = 0;
  std::string message;
  Eigen::VectorXd r;
  RowMatrixXd jacobian;

  bool At(double x, bool with_jacobian) {
    message.clear();
    return log->Evaluate(
        Eigen::VectorXd::Constant(1, x),
        [&](Eigen::VectorXd* residuals, RowMatrixXd* derivatives) {
          ++calls;
          rollouts += 2;
          if (!(x >= 0.0)) {
            message = "below 0";
            return false;
          }
          residuals->setConstant(1, x * x);
          if (derivatives != nullptr) {
            derivatives->setConstant(1, 1, 2.0 * x);
          }
          return true;
        },
        &r, with_jacobian ? &jacobian : nullptr, &rollouts, &message);
  }
};

TEST(EvaluationLogTest, HandsOutWhatItHasAndThenComputes) {
  EvaluationLog log;
  int iterations = 0;
  log.OnIteration([&] { ++iterations; });
  Square first{&log};
  EXPECT_TRUE(first.At(3.0, true));
  EXPECT_TRUE(first.At(4.0, false));
  EXPECT_FALSE(first.At(-1.0, false));
  EXPECT_EQ(first.calls, 3);
  EXPECT_EQ(iterations, 1) << "those with Jacobians";

  EvaluationLog again;
  again.Restore(log.evaluations());
  Square second{&again};
  EXPECT_TRUE(second.At(3.0, true));
  EXPECT_EQ(second.r[0], 9.0);
  EXPECT_EQ(second.jacobian(0, 0), 6.0);
  EXPECT_TRUE(second.At(4.0, false));
  EXPECT_EQ(second.r[0], 16.0);
  EXPECT_FALSE(second.At(-1.0, false));
  EXPECT_EQ(second.message, "below 0");
  EXPECT_EQ(second.r[0], 16.0) << "a failed evaluation leaves results alone";
  EXPECT_EQ(second.calls, 0);
  EXPECT_EQ(second.rollouts, 6);
  EXPECT_TRUE(second.At(5.0, true));
  EXPECT_EQ(second.calls, 1);
  EXPECT_EQ(again.evaluations().size(), 4u);
  EXPECT_EQ(again.mismatch(), 0);
}

TEST(EvaluationLogTest, ThrowsAtAnotherPointOrRequest) {
  EvaluationLog log;
  Square square{&log};
  EXPECT_TRUE(square.At(0.0, true));
  EXPECT_TRUE(square.At(2.0, true));
  for (const bool other_point : {true, false}) {
    EvaluationLog again;
    again.Restore(log.evaluations());
    Square second{&again};
    EXPECT_TRUE(second.At(0.0, true));
    EXPECT_THROW(second.At(other_point ? std::nextafter(2.0, 3.0) : 2.0, other_point),
                 EvaluationMismatch);
    EXPECT_EQ(again.mismatch(), 2);
    EXPECT_EQ(second.calls, 0);
  }
  EvaluationLog again;
  again.Restore(log.evaluations());
  EXPECT_THROW(Square{&again}.At(-0.0, true), EvaluationMismatch) << "equal, but other bits";
}

TEST(EvaluationLogTest, KeepsNoMoreThanItsShare) {
  EvaluationLog log;
  Eigen::VectorXd r;
  long rollouts = 0;
  std::string message;
  const auto evaluate = [&](double x, Eigen::Index size) {
    return log.Evaluate(
        Eigen::VectorXd::Constant(1, x),
        [&](Eigen::VectorXd* residuals, RowMatrixXd*) {
          residuals->setConstant(size, x);
          return true;
        },
        &r, nullptr, &rollouts, &message);
  };
  EXPECT_TRUE(evaluate(1.0, 10));
  EXPECT_TRUE(evaluate(2.0, EvaluationLog::kMaxNumbers));
  // A gap would put all that follows at the wrong place.
  EXPECT_TRUE(evaluate(3.0, 10));
  EXPECT_EQ(r, Eigen::VectorXd::Constant(10, 3.0));
  EXPECT_EQ(log.evaluations().size(), 1u);
  log.Clear();
  EXPECT_TRUE(evaluate(4.0, 10));
  EXPECT_EQ(log.evaluations().size(), 1u);
}

}  // namespace
}  // namespace tangible
