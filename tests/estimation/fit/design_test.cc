// SPDX-License-Identifier: Apache-2.0
//
// The design of the next experiment against closed forms and against a second fit.
#include "tangible/estimation/fit/design.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/tolerances.h"

namespace tangible {
namespace {

constexpr double kSigma = 0.01;

// A ball that flies freely: x = vx (1 − e^(−d t / m)) m / d, y = vy t + g t² / 2 without damping.
Scene Throw(double damping) {
  const std::string number = std::to_string(damping);
  return MakeScene(R"({"bodies": [{"name": "ball", "mass": 2, "inertia": 1, "position": [0, 0],
    "velocity": [2, 3], "linear_damping": )" +
                   number + R"(}], "simulation": {"dt": 0.05, "duration": 1,
    "stepping": "event"}})");
}

FitInput InputOfThrow(const Scene& scene, const std::vector<FitParameter>& parameters,
                      unsigned seed = 1) {
  FitProblem problem;
  problem.scene = scene;
  problem.parameters = parameters;
  problem.observations = Observe(scene, 1, kSigma, seed);
  return InputOf(problem);
}

struct Fitted {
  FitInput input;
  std::unique_ptr<RecordingsProblem> problem;
  FitResult result;
};

Fitted FitThrow(const FitInput& input) {
  Fitted fitted{input, nullptr, {}};
  ParameterError error;
  int fault = 0;
  fitted.problem = MakeProblem(input, &error, &fault);
  EXPECT_NE(fitted.problem, nullptr) << error.what;
  fitted.result = Fit(input.options(), fitted.problem.get(), {});
  EXPECT_EQ(fitted.result.status, FitStatus::kConverged) << fitted.result.message;
  return fitted;
}

Design DesignOf(const Fitted& fitted, const DesignRequest& request) {
  Design design;
  for (const DesignCandidate& candidate : request.candidates) {
    EXPECT_EQ(CheckCandidate(fitted.input, candidate), "");
  }
  EXPECT_EQ(
      MakeDesign(fitted.input, request, fitted.result.estimate, fitted.problem.get(), &design), "");
  for (const CandidateWorth& worth : design.candidates) EXPECT_EQ(worth.message, "");
  return design;
}

// Σ a_i b_i over the times of n steps of 0.05 s.
template <typename A, typename B>
double Sum(int n, const A& a, const B& b) {
  double sum = 0.0;
  for (int i = 0; i <= n; ++i) sum += a(0.05 * i) * b(0.05 * i);
  return sum;
}
double Linear(double t) { return t; }
double Fall(double t) { return 0.5 * t * t; }

double Width(double information) { return 2.0 * kNormalQuantile * kSigma / std::sqrt(information); }

TEST(DesignTest, GravityOfAFallByItsDuration) {
  const Fitted fitted = FitThrow(InputOfThrow(Throw(0.0), {Parameter("gravity/y", -9.0)}));
  const double now = Sum(20, Fall, Fall), longer = Sum(40, Fall, Fall);
  const double shorter = Sum(10, Fall, Fall);
  // A third of the width that is there.
  const double wanted = Width(now) / 3.0;
  const Design design =
      DesignOf(fitted, {{{{}, 0.5, -1}, {{}, 2.0, -1}, {{}, std::nullopt, -1}}, {{0, wanted}}});
  ASSERT_EQ(design.parameters, std::vector<int>{0});
  EXPECT_NEAR(design.widths[0], Width(now), 1e-9 * Width(now));
  EXPECT_NEAR(design.widths[0],
              2.0 * kNormalQuantile * fitted.result.uncertainty.standard_deviation[0], 1e-9);
  const double of[] = {shorter, longer, now};
  const long observations[] = {33, 123, 63};
  for (size_t c = 0; c < 3; ++c) {
    const CandidateWorth& worth = design.candidates[c];
    EXPECT_EQ(worth.observations, observations[c]);
    EXPECT_NEAR(worth.widths[0], Width(now + of[c]), 1e-9 * Width(now));
    EXPECT_NEAR(worth.gain, 0.5 * std::log(1.0 + of[c] / now), 1e-9);
    ASSERT_TRUE(worth.takes[0].has_value());
    EXPECT_EQ(*worth.takes[0], static_cast<long>(std::ceil((9.0 - 1.0) * now / of[c] - 1e-9)));
  }
  EXPECT_EQ(design.best_d, 1);
  EXPECT_EQ(design.best_a, 1);
  EXPECT_EQ(design.narrowest, std::vector<int>{1});
}

// A start that has to be found anew in each take is eliminated from it.
TEST(DesignTest, AnUnknownStartIsEliminated) {
  const Fitted fitted = FitThrow(InputOfThrow(
      Throw(0.0), {Parameter("gravity/y", -9.0), Parameter("bodies/ball/velocity/y", 2.0)}));
  const auto information = [](int n) {
    const double cross = Sum(n, Fall, Linear);
    return Sum(n, Fall, Fall) - cross * cross / Sum(n, Linear, Linear);
  };
  const Design design =
      DesignOf(fitted, {{{{{"bodies/ball/velocity/y", 7.0}}, 2.0, -1}}, {{0, 1e-12}}});
  ASSERT_EQ(design.parameters, std::vector<int>{0});
  EXPECT_NEAR(design.widths[0], Width(information(20)), 1e-7 * design.widths[0]);
  EXPECT_NEAR(design.candidates[0].widths[0], Width(information(20) + information(40)),
              1e-7 * design.widths[0]);
  EXPECT_FALSE(design.candidates[0].takes[0].has_value()) << "more than a million";
}

// The derivative by damping is in proportion to the speed, and so is not the one by gravity.
TEST(DesignTest, ThreeTimesTheSpeedHasNineTimesTheInformationAboutDamping) {
  Scene scene = Throw(0.3);
  scene.gravity = Vector2<double>(0.0, 0.0);
  const Fitted fitted =
      FitThrow(InputOfThrow(scene, {Parameter("bodies/ball/linear_damping", 0.2)}));
  const Design design = DesignOf(
      fitted,
      {{{{{"bodies/ball/velocity/x", 1.0}}, std::nullopt, -1},
        {{{"bodies/ball/velocity/x", 6.0}, {"bodies/ball/velocity/y", 9.0}}, std::nullopt, -1}},
       {}});
  EXPECT_NEAR(design.candidates[1].widths[0], design.widths[0] / std::sqrt(10.0),
              1e-9 * design.widths[0]);
  EXPECT_NEAR(design.candidates[1].gain, 0.5 * std::log(10.0), 1e-9);
  // x and y: 10 / 13 of the information of the first take.
  EXPECT_NEAR(design.candidates[0].widths[0], design.widths[0] / std::sqrt(1.0 + 10.0 / 13.0),
              1e-9 * design.widths[0]);
  EXPECT_EQ(design.best_d, 1);
}

// What the first take does not determine has no width, until a candidate determines it.
TEST(DesignTest, WhatWasNotDeterminedCanBe) {
  Scene still = Throw(0.3);
  still.bodies[0].velocity = Vector2<double>(0.0, 0.0);
  still.gravity = Vector2<double>(0.0, 0.0);
  const FitInput input = InputOfThrow(still, {Parameter("bodies/ball/linear_damping", 0.3)});
  ParameterError error;
  int fault = 0;
  const std::unique_ptr<RecordingsProblem> problem = MakeProblem(input, &error, &fault);
  Design design;
  Eigen::VectorXd estimate(1);
  estimate << 0.3;
  ASSERT_EQ(MakeDesign(input,
                       {{{{}, std::nullopt, -1}, {{{"bodies/ball/velocity/x", 2.0}}, 1.0, -1}},
                        {{0, 0.1}}},
                       estimate, problem.get(), &design),
            "");
  EXPECT_TRUE(std::isnan(design.widths[0]));
  EXPECT_TRUE(std::isnan(design.candidates[0].widths[0]));
  EXPECT_FALSE(design.candidates[0].takes[0].has_value());
  EXPECT_GT(design.candidates[1].widths[0], 0.0);
  EXPECT_TRUE(std::isnan(design.candidates[1].gain));
  EXPECT_EQ(design.best_d, 1);
  EXPECT_EQ(design.narrowest, std::vector<int>{1});
}

// The widths of a fit to a first and a second, simulated take are those that were predicted.
TEST(DesignTest, ASecondTakeNarrowsAsPredicted) {
  const std::vector<FitParameter> parameters = {Parameter("gravity/y", -9.0),
                                                Parameter("bodies/ball/linear_damping", 0.2)};
  const FitInput first = InputOfThrow(Throw(0.3), parameters);
  const Fitted fitted = FitThrow(first);
  const Design design = DesignOf(
      fitted,
      {{{{{"bodies/ball/velocity/x", 8.0}, {"bodies/ball/velocity/y", -1.0}}, 1.5, -1}}, {}});
  Scene scene = Throw(0.3);
  scene.bodies[0].velocity = Vector2<double>(8.0, -1.0);
  scene.simulation.duration = 1.5;
  FitInput both = first;
  both.recordings.push_back(InputOfThrow(scene, parameters, 2).recordings[0]);
  both.recordings[0].name = "first";
  both.recordings[1].name = "second";
  const Fitted second = FitThrow(both);
  for (int k = 0; k < 2; ++k) {
    const double real = 2.0 * kNormalQuantile * second.result.uncertainty.standard_deviation[k];
    // The estimates differ by the noise, on which the derivatives depend to first order.
    EXPECT_NEAR(design.candidates[0].widths[k], real, 0.01 * real) << k;
    EXPECT_LT(real, 0.8 * design.widths[k]) << k;
  }
}

TEST(DesignTest, CandidatesThatCannotBeMade) {
  const FitInput input = InputOfThrow(Throw(0.3), {Parameter("gravity/y", -9.0)});
  EXPECT_EQ(CheckCandidate(input, {{{"gravity/y", -1.0}}, std::nullopt, -1}),
            "gravity/y: expected a number that is not to be found, got that of parameter "
            "gravity/y");
  EXPECT_NE(CheckCandidate(input, {{{"bodies/cube/mass", 1.0}}, std::nullopt, -1}), "");
  EXPECT_EQ(CheckCandidate(input, {{{"bodies/ball/mass", -1.0}}, std::nullopt, -1}),
            "bodies/ball/mass: expected a number > 0, got -1.0");
  EXPECT_NE(CheckCandidate(input, {{}, 1e9, -1}).find("at most 1e7 observations"),
            std::string::npos);
  EXPECT_NE(CheckCandidate(input, {{}, std::nullopt, 0}).find("expected a camera"),
            std::string::npos);
}

}  // namespace
}  // namespace tangible
