// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/app/fit_printer.h"

#include <cmath>
#include <cstdio>
#include <iostream>

#include "tangible/estimation/fit/profile.h"

namespace tangible {

std::string Cell(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

namespace {

/// The interval that counts, with the standard deviation that belongs to it.
std::string EstimateLine(const std::string& name, int k, const FitResult& result) {
  const Uncertainty& uncertainty = result.uncertainty;
  const FinalInterval& interval = result.intervals[static_cast<size_t>(k)];
  std::string line = name + " = " + Cell(result.estimate[k], 10);
  const bool robust = std::isfinite(uncertainty.standard_deviation_robust[k]);
  const double deviation =
      robust ? uncertainty.standard_deviation_robust[k] : uncertainty.standard_deviation[k];
  if (std::isfinite(deviation)) {
    line += " ± " + Cell(deviation, 3);
  }
  const std::string& why = uncertainty.messages[k];
  if (!interval.exists) {
    line += " (" + (why.empty() ? "no interval" : why) + ")";
  } else {
    line += " (95 %: " + Describe(interval);
    if (interval.method == "robust") {
      line += ", " + Cell(uncertainty.degrees_of_freedom[k], 3) + " degrees of freedom";
    } else {
      line += interval.method == "profile"     ? ", by its profile"
              : interval.method == "posterior" ? ", of the posterior"
                                               : ", from sigma alone";
    }
    line += why.empty() ? ")" : "; " + why + ")";
  }
  if (uncertainty.prior_share[k] > 0.0) {
    line += ", " + Cell(100.0 * uncertainty.prior_share[k], 3) + " % of this by priors";
  }
  return line;
}

/// The profiles in one line each, and the pieces of those that have several.
void PrintProfiles(const std::vector<ParameterizedScene::Entry>& entries, const FitResult& result) {
  for (const Profile& profile : result.profiles) {
    std::cout << "profile of " << entries[static_cast<size_t>(profile.parameter)].name << " ("
              << profile.why << "): " << profile.points.size() << " values, cost up to "
              << Cell(profile.rise) << " above the minimum at";
    for (size_t i = 0; i < profile.branches.size(); ++i) {
      const ProfileBranch& branch = profile.branches[i];
      std::cout << (i == 0 ? " " : " and ")
                << Describe(FinalInterval{true, branch.low, branch.high, "profile"});
    }
    std::cout << "\n";
  }
}

/// What led to the minimum, where that was not the plain fit alone.
void PrintApproach(const FitResult& result) {
  for (size_t i = 0; i < result.starts.size(); ++i) {
    const FitStart& start = result.starts[i];
    const bool plain = start.approach == "plain";
    if (plain && start.tried.empty()) {
      continue;
    }
    std::cout << "start " << i << ": " << start.approach << (plain ? " leads" : " lead")
              << " to a cost of " << Cell(start.cost);
    if (!plain && std::isfinite(start.plain_cost)) {
      std::cout << ", the plain fit to " << Cell(start.plain_cost);
    }
    if (!start.tried.empty()) {
      std::cout << ", " << start.tried << " to "
                << (std::isfinite(start.tried_cost) ? Cell(start.tried_cost) : "none")
                << ", which is no better";
    }
    std::cout << (start.message.empty() ? "" : "; " + start.message) << "\n";
  }
}

}  // namespace

void PrintEstimates(const std::vector<ParameterizedScene::Entry>& entries,
                    const FitResult& result) {
  const Uncertainty& uncertainty = result.uncertainty;
  for (size_t k = 0; k < entries.size(); ++k) {
    std::string line = EstimateLine(entries[k].name, static_cast<int>(k), result);
    if (k == 0) {
      line += ", " + std::to_string(result.iterations.size() - 1) + " iterations, " +
              Cell(result.seconds, 2) + " s";
    }
    std::cout << line << "\n";
  }
  std::cout << DescribeRobust(uncertainty) << "\n";
  PrintProfiles(entries, result);
  PrintApproach(result);
  if (!result.agreement.empty()) {
    std::cout << result.agreement << "\n";
  }
  std::cout << "cost " << Cell(result.initial_cost) << " -> " << Cell(result.final_cost)
            << ", residual rms " << Cell(uncertainty.residual_rms, 4)
            << " sigma, reduced chi-square " << Cell(uncertainty.reduced_chi_square, 4) << ", "
            << result.rollouts << " rollouts\n";
  for (const std::string& warning : uncertainty.warnings) {
    std::cout << "warning: " << warning << "\n";
  }
}

void PrintComponents(const VarianceComponents& components) {
  for (const SensorNoise& sensor : components.noise) {
    std::cout << "sigma of sensor " << sensor.name << ": " << Cell(sensor.factor, 5) << " ± "
              << Cell(sensor.deviation, 2) << " times what was given, from " << sensor.count
              << " observations\n";
  }
  for (const SpreadEstimate& spread : components.spreads) {
    const bool gaussian = spread.kind == PriorKind::kGaussian;
    std::cout << "spread of " << (gaussian ? "" : "ln ") << spread.name << ": "
              << Cell(spread.spread, 5);
    if (spread.interval) {
      std::cout << " (95 %: " << Cell(spread.interval->first, 5) << " to "
                << Cell(spread.interval->second, 5) << ")";
    }
    std::cout << (spread.estimated ? "" : " (given)") << ", " << spread.recordings << " recordings"
              << (spread.estimated && spread.spread == 0.0
                      ? "; they do not differ by more than their noise explains"
                      : "")
              << "\n";
  }
}

void PrintOutliers(const ResidualSummary& summary) {
  if (summary.num_outliers == 0) {
    return;
  }
  const Outlier& first = summary.outliers.front();
  std::cout << summary.num_outliers << (summary.num_outliers == 1 ? " outlier" : " outliers")
            << ", the largest at " << Cell(first.time, 8) << " s in "
            << summary.series[first.series].label << ": " << Cell(first.residual, 4) << " sigma\n";
}

void PrintCheck(const std::vector<ParameterizedScene::Entry>& entries,
                const DiscretisationCheck& check) {
  for (Eigen::Index k = 0; k < check.bias.size(); ++k) {
    std::cout << "bias of the step dt = " << Cell(check.dt) << " s on " << entries[k].name << ": "
              << Cell(check.bias[k], 3) << " to " << OrderName(check.order)
              << " order (difference to dt / 2: " << Cell(check.difference[k], 3)
              << ", extrapolated to " << Cell(check.extrapolated[k], 8) << ")\n";
  }
}

void PrintScore(const PredictionScore& score) {
  if (!score.message.empty()) {
    return;
  }
  std::cout << "prediction of " << score.all.count << " observations after " << Cell(score.from)
            << " s: rms " << Cell(score.all.rms_in_sigma, 4) << " sigma";
  if (std::isfinite(score.all.rms_length)) {
    std::cout << ", " << Cell(score.all.rms_length, 4) << " m (largest "
              << Cell(score.all.max_length, 4) << ")";
  }
  if (std::isfinite(score.all.rms_angle)) {
    std::cout << ", " << Cell(score.all.rms_angle, 4) << " rad (largest "
              << Cell(score.all.max_angle, 4) << ")";
  }
  std::cout << "\n";
}

}  // namespace tangible
