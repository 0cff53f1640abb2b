// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/errata/errata.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

double RelativeError(double a, double b) { return std::abs(a - b) / std::abs(b); }

class ErrataTest : public ::testing::Test {
 protected:
  const SlidingBody body_ = ExampleBody();
  const std::vector<double> differences_ = GradientByDifferences(body_, Misprint::kNone);
};

TEST_F(ErrataTest, TheExampleSlidesAndNoEntryIsZero) {
  const LcpSolution<double> solution = SolveLcp(ProblemOf(body_));
  ASSERT_EQ(solution.status, LcpStatus::kSolved);
  EXPECT_GT(solution.z[0], 0.1);                           // λn
  EXPECT_GT(solution.z[3], 0.1);                           // the sliding speed
  EXPECT_NEAR(solution.z[2], 0.4 * solution.z[0], 1e-12);  // λ− = μ λn
  ASSERT_EQ(differences_.size(), static_cast<size_t>(kNumSlidingParameters));
  for (const double d : differences_) EXPECT_GT(std::abs(d), 1e-3);
}

TEST_F(ErrataTest, TheRightFormulasAreTheDifferences) {
  const std::vector<double> right = GradientByFormulas(body_, Misprint::kNone);
  ASSERT_EQ(right.size(), differences_.size());
  for (size_t k = 0; k < right.size(); ++k) {
    EXPECT_LT(RelativeError(right[k], differences_[k]), 1e-9)
        << NameOf(static_cast<SlidingParameter>(k));
  }
}

TEST_F(ErrataTest, WithoutDOfZBeforeFEveryEntryIsOff) {
  const std::vector<double> printed = GradientByFormulas(body_, Misprint::kDifferential);
  for (size_t k = 0; k < printed.size(); ++k) {
    EXPECT_GT(RelativeError(printed[k], differences_[k]), 0.1)
        << NameOf(static_cast<SlidingParameter>(k));
  }
}

TEST_F(ErrataTest, ThePrintedGradientOfGIsOffWhereGChanges) {
  const std::vector<double> printed = GradientByFormulas(body_, Misprint::kGradientOfG);
  for (size_t k = 0; k < printed.size(); ++k) {
    const bool in_g = k == kArmX || k == kArmY;
    const double error = RelativeError(printed[k], differences_[k]);
    EXPECT_TRUE(in_g ? error > 0.1 : error < 1e-9) << NameOf(static_cast<SlidingParameter>(k));
  }
}

TEST_F(ErrataTest, ThePrintedSignOfQTurnsTheMotionRound) {
  const LcpSolution<double> printed = SolveLcp(ProblemOf(body_, Misprint::kSignOfQ));
  ASSERT_EQ(printed.status, LcpStatus::kSolved);
  EXPECT_LT(printed.v[0], 0.0);  // v = 1.5 m/s before, pushed forward
  const std::vector<double> gradient = GradientByDifferences(body_, Misprint::kSignOfQ);
  ASSERT_EQ(gradient.size(), differences_.size());
  for (size_t k = 0; k < gradient.size(); ++k) {
    EXPECT_GT(RelativeError(gradient[k], differences_[k]), 0.1);
  }
}

TEST_F(ErrataTest, ThePrintedSignOfFHoldsWhatShouldSlide) {
  const LcpSolution<double> printed = SolveLcp(ProblemOf(body_, Misprint::kSignOfF));
  ASSERT_EQ(printed.status, LcpStatus::kSolved);
  // The speed of the contact along the floor.
  EXPECT_NEAR(printed.v[0] - body_[kArmY] * printed.v[2], 0.0, 1e-9);
  const std::vector<double> gradient = GradientByDifferences(body_, Misprint::kSignOfF);
  ASSERT_EQ(gradient.size(), differences_.size());
  EXPECT_NEAR(gradient[kFrictionCoefficient], 0.0, 1e-9);
  for (size_t k = 0; k < gradient.size(); ++k) {
    EXPECT_GT(RelativeError(gradient[k], differences_[k]), 0.1);
  }
}

TEST_F(ErrataTest, TheFormulasAreThoseOfTheEngine) {
  // ℓ_p of lib/lcp is −∂ℓ/∂q here, with x = −v⁺.
  const MixedLcp<double> problem = ProblemOf(body_);
  const LcpSolution<double> solution = SolveLcp(problem);
  const LcpDerivative derivative(problem, {solution.v, solution.y, solution.z});
  LcpVector loss{VectorX<double>(3), VectorX<double>(0), VectorX<double>::Zero(4)};
  loss.v << 1.0, 0.4, 0.15;
  const MixedLcp<double> gradient = derivative.Adjoint(loss);
  const std::vector<double> right = GradientByFormulas(body_, Misprint::kNone);
  EXPECT_NEAR(gradient.p[0] * body_[kMass], right[kVelocityX], 1e-12);
  EXPECT_NEAR(gradient.F(3, 0), right[kFrictionCoefficient], 1e-12);
  EXPECT_NEAR(gradient.G(0, 2), right[kArmX], 1e-12);
  EXPECT_NEAR(gradient.c[0], right[kGapSpeed], 1e-12);
}

TEST_F(ErrataTest, TheTableSaysSo) {
  const ErrataTable table = ComputeErrata();
  EXPECT_EQ(BrokenErrata(table), "");
  EXPECT_EQ(table.bodies, 200);
  EXPECT_EQ(table.wrong[0], 2000);
  EXPECT_EQ(table.wrong[1], 400);  // the arm's two
  for (const double median : table.median_printed) EXPECT_GT(median, 0.1);
  const std::string text = ErrataText(table);
  EXPECT_EQ(text.rfind("| gradient with respect to |", 0), 0u) << text;
  EXPECT_NE(text.find("| arm y |"), std::string::npos) << text;
  ErrataTable broken = table;
  broken.right[kMass] *= 1.0 + 1e-8;
  EXPECT_NE(BrokenErrata(broken).find("mass"), std::string::npos);
  broken = table;
  broken.printed[1] = broken.right;
  EXPECT_NE(BrokenErrata(broken).find("gradient of G"), std::string::npos);
}

TEST(ErrataBodyTest, ABodyThatLiftsOffHasNoGradientByTheseFormulas) {
  SlidingBody body = ExampleBody();
  body[kVelocityY] = 2.0;
  EXPECT_TRUE(GradientByFormulas(body, Misprint::kNone).empty());
}

}  // namespace
}  // namespace tangible
