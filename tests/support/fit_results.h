// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A result of a fit with numbers made by hand, for tests of what is written about it.

#include <limits>

#include "fit_scenes.h"
#include "tangible/estimation/fit/discretisation.h"

namespace tangible {

/// Two parameters, seen in x (twice) and y.
inline RecordingsProblem HandMadeProblem() {
  return RecordingsProblem(
      MakeResiduals(MakeScene(kFallingBall), {},
                    {Parameter("gravity/y", -9.0), Parameter("bodies/ball/linear_damping", 0.1)},
                    {{0.5, 0, -1, Coordinate::kX, 0.5, 0.1},
                     {0.5, 0, -1, Coordinate::kY, 10.0, 0.2},
                     {1.0, 0, -1, Coordinate::kX, 1.0, 0.1}}));
}

inline FitStart HandMadeStart(const std::vector<double>& initial, double cost,
                              const std::string& status) {
  FitStart start;
  start.initial = initial;
  start.cost = cost;
  start.iterations = 1;
  start.status = status;
  return start;
}

/// Gravity with an interval, a damping at its bound without.
inline FitResult HandMadeResult() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  FitResult result;
  result.status = FitStatus::kConverged;
  result.message = "done & <well>";
  result.estimate = Eigen::Vector2d(-9.8125, 1.0 / 3.0);
  result.uncertainty.covariance.setConstant(2, 2, kNone);
  result.uncertainty.covariance(0, 0) = 0.0625;
  result.uncertainty.standard_deviation = Eigen::Vector2d(0.25, kNone);
  result.uncertainty.confidence_95 = {std::pair(-10.3125, -9.3125), std::nullopt};
  result.uncertainty.standard_deviation_robust = Eigen::Vector2d(0.5, kNone);
  result.uncertainty.degrees_of_freedom = Eigen::Vector2d(6.5, kNone);
  result.uncertainty.confidence_95_robust = {std::pair(-11.0, -8.625), std::nullopt};
  result.intervals = {{true, -11.0, -8.625, "robust"}, {}};
  result.uncertainty.robust_method = RobustMethod::kTime;
  result.uncertainty.bandwidth = 0.25;
  result.uncertainty.prior_share = Eigen::Vector2d::Zero();
  result.uncertainty.messages = {"", "at its lower bound"};
  result.uncertainty.reduced_chi_square = kNone;
  result.uncertainty.warnings = {"a < b"};
  result.initial_cost = 40.0;
  result.final_cost = 3.0;
  result.iterations = {{40.0, 5.0, {-9.0, 0.1}, 0.0}, {3.0, 1e-9, {-9.8125, 1.0 / 3.0}, 0.5}};
  result.starts = {HandMadeStart({-9.0, 0.1}, 3.0, "converged")};
  result.residuals = Eigen::Vector3d(3.0, -2.0, 4.0);
  result.rollouts = 7;
  return result;
}

inline DiscretisationCheck HandMadeCheck() {
  DiscretisationCheck check;
  check.dt = 0.01;
  check.status = FitStatus::kConverged;
  check.estimate_half_step = Eigen::Vector2d(-9.75, 0.5);
  check.difference = Eigen::Vector2d(-0.0625, 0.125);
  check.bias = 2.0 * check.difference;
  check.extrapolated = Eigen::Vector2d(-9.6875, 0.0625);
  return check;
}

}  // namespace tangible
