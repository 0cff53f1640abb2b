// SPDX-License-Identifier: Apache-2.0
//
// tangible-fit: identifies parameters of a scene from observed positions.

#include <gflags/gflags.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/report.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"

DEFINE_string(out, "", "file of the result (JSON); empty: none is written");
DEFINE_string(report, "", "file of the report (HTML); empty: none is written");
DEFINE_string(checkpoint, "",
              "file that keeps what is done as the fit goes on; where it is there already the fit "
              "goes on from it, and ends as if it had not been interrupted. It stays when the fit "
              "is done");
DEFINE_bool(discretisation_check, false,
            "fit at dt / 2 too and report the difference as the bias of the step");
DEFINE_string(derivatives, "",
              "tangent, adjoint, jet, jet_implicit or finite_difference, instead of the file's");
DEFINE_string(initial, "", "other initial values: name=value, separated by commas");
DEFINE_int32(max_iterations, 50, "of each start");

namespace tangible {
namespace {

/// "chain mass=20,friction=0.1" into the parameters; returns what is wrong or empty.
std::string OverrideInitial(const std::string& text, std::vector<FitParameter>* parameters) {
  size_t begin = 0;
  while (begin < text.size()) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    begin = end + 1;
    const size_t equal = item.rfind('=');
    double value = 0.0;
    if (equal == std::string::npos || !ParseNumber(item.substr(equal + 1), &value)) {
      return "expected name=value, got '" + item + "'";
    }
    bool known = false;
    for (FitParameter& parameter : *parameters) {
      if (parameter.name == item.substr(0, equal)) {
        parameter.initial = value;
        known = true;
      }
    }
    if (!known) {
      return "expected the name of a parameter, got '" + item.substr(0, equal) + "'";
    }
  }
  return "";
}

std::string OverrideDerivatives(FitOptions* options) {
  if (FLAGS_derivatives.empty()) {
    return "";
  }
  for (const DerivativeMethod method :
       {DerivativeMethod::kTangent, DerivativeMethod::kAdjoint, DerivativeMethod::kJet,
        DerivativeMethod::kJetImplicit, DerivativeMethod::kFiniteDifference}) {
    if (FLAGS_derivatives == NameOf(method) && IsAvailable(method)) {
      options->derivatives = method;
      return "";
    }
  }
  return "expected tangent, adjoint, jet, jet_implicit or finite_difference (Jets if built with "
         "them), got '" +
         FLAGS_derivatives + "'";
}

std::string Cell(double value, int digits = 6) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

void PrintIteration(const std::vector<ParameterizedScene::Entry>& entries, int start, int iteration,
                    const FitIteration& values) {
  constexpr size_t kMostColumns = 6;
  if (iteration == 0) {
    if (start > 0) {
      std::printf("start %d\n", start + 1);
    }
    std::printf("%4s %13s %11s", "iter", "cost", "gradient");
    for (size_t k = 0; k < entries.size() && k < kMostColumns; ++k) {
      std::printf(" %14.14s", entries[k].name.c_str());
    }
    std::printf("%s %9s\n", entries.size() > kMostColumns ? " ..." : "", "seconds");
  }
  std::printf("%4d %13.6e %11.3e", iteration, values.cost, values.gradient_norm);
  for (size_t k = 0; k < entries.size() && k < kMostColumns; ++k) {
    std::printf(" %14.9g", values.parameters[k]);
  }
  std::printf("%s %9.3f\n", entries.size() > kMostColumns ? " ..." : "", values.seconds);
  std::fflush(stdout);
}

/// "± 0.01 (95 %: 1 to 2" or empty.
std::string IntervalText(double deviation, const ConfidenceInterval& interval) {
  return interval ? "± " + Cell(deviation, 3) + " (95 %: " + Cell(interval->first, 8) + " to " +
                        Cell(interval->second, 8)
                  : "";
}

/// The robust interval first, then the one that trusts sigma.
std::string EstimateLine(const std::string& name, int k, const FitResult& result) {
  const Uncertainty& uncertainty = result.uncertainty;
  const std::string robust =
      IntervalText(uncertainty.standard_deviation_robust[k], uncertainty.confidence_95_robust[k]);
  const std::string trusting =
      IntervalText(uncertainty.standard_deviation[k], uncertainty.confidence_95[k]);
  std::string line = name + " = " + Cell(result.estimate[k], 10);
  if (!robust.empty()) {
    line += " " + robust + ", " + Cell(uncertainty.degrees_of_freedom[k], 3) +
            " degrees of freedom); from sigma alone";
  }
  if (!trusting.empty()) {
    line += " " + trusting + ")";
  } else {
    line += " (" + uncertainty.messages[k] + ")";
  }
  if (uncertainty.prior_share[k] > 0.0) {
    line += ", " + Cell(100.0 * uncertainty.prior_share[k], 2) + " % of this by priors";
  }
  return line;
}

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
  std::cout << "cost " << Cell(result.initial_cost) << " -> " << Cell(result.final_cost)
            << ", residual rms " << Cell(uncertainty.residual_rms, 4)
            << " sigma, reduced chi-square " << Cell(uncertainty.reduced_chi_square, 4) << ", "
            << result.rollouts << " rollouts\n";
  for (const std::string& warning : uncertainty.warnings) {
    std::cout << "warning: " << warning << "\n";
  }
}

void PrintCheck(const std::vector<ParameterizedScene::Entry>& entries,
                const DiscretisationCheck& check) {
  for (Eigen::Index k = 0; k < check.bias.size(); ++k) {
    std::cout << "bias of the step dt = " << Cell(check.dt) << " s on " << entries[k].name << ": "
              << Cell(check.bias[k], 3)
              << " to first order (difference to dt / 2: " << Cell(check.difference[k], 3)
              << ", extrapolated to " << Cell(check.extrapolated[k], 8) << ")\n";
  }
}

int WriteFiles(const FitFile& fit, const RolloutResiduals& residuals, const FitResult& result,
               const DiscretisationCheck* check) {
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = ResultToJson(residuals, result, check);
    json["certificate"] =
        result.estimate.size() > 0 ? ToJson(result.certificate) : OrderedJson(nullptr);
    return JsonText(json);
  });
  if (result.estimate.size() > 0) {
    writer.Write(FLAGS_report, [&] { return FitReport(fit.path, residuals, result, check); });
  }
  return writer.error().empty() ? kExitDone : ReportError(writer.error());
}

/// A checkpoint in its file, with what that holds already; null without --checkpoint. Returns what
/// is wrong or empty: a file that cannot be written is found before the work, not after it.
std::string OpenCheckpoint(const FitProblem& problem, std::unique_ptr<FitCheckpoint>* checkpoint) {
  if (FLAGS_checkpoint.empty()) {
    return "";
  }
  *checkpoint = std::make_unique<FitCheckpoint>(problem, [](const std::string& text) {
    return WriteFileAtomically(FLAGS_checkpoint, text, Over::kOwnInput);
  });
  std::error_code none;
  if (std::filesystem::exists(FLAGS_checkpoint, none)) {
    if (!std::filesystem::is_regular_file(FLAGS_checkpoint, none)) {
      return FLAGS_checkpoint + ": cannot be written: expected a file, got a device or pipe";
    }
    std::string text;
    std::string error;
    if (!ReadTextFile(FLAGS_checkpoint, &text, &error)) {
      return error;
    }
    // It is not written again before there is something new: with what a restart takes the fit
    // would not get on where it is often ended.
    return (*checkpoint)->Restore(text, FLAGS_checkpoint);
  }
  return (*checkpoint)->Write();
}

/// One line unless the log was of this very fit; empty without one.
std::string Mismatch(const FitLog* log) {
  if (log == nullptr || log->mismatch() == 0) {
    return "";
  }
  return FLAGS_checkpoint + ": /fits: evaluation " + std::to_string(log->mismatch()) +
         " is not the one that this program makes: written by another version or on another "
         "machine; remove the file to begin anew";
}

int Run(const std::string& file) {
  FitFile fit;
  std::string error;
  if (!LoadFit(file, &fit, &error)) {
    return ReportError(error);
  }
  FitProblem& problem = fit.problem;
  problem.options.max_iterations = FLAGS_max_iterations;
  error = OverrideInitial(FLAGS_initial, &problem.parameters);
  if (!error.empty()) {
    return ReportError("tangible-fit: --initial: " + error, kExitUsage);
  }
  error = OverrideDerivatives(&problem.options);
  if (!error.empty()) {
    return ReportError("tangible-fit: --derivatives: " + error, kExitUsage);
  }
  std::vector<RolloutResiduals> made;
  if (!MakeResiduals(problem, file, &made, &error)) {
    return ReportError(error);
  }
  error = OutputOverInput({"out", "report", "checkpoint"});
  if (!error.empty()) {
    return ReportError("tangible-fit: " + error, kExitUsage);
  }
  RolloutResiduals& residuals = made.front();
  const auto& entries = residuals.scene().entries();
  std::unique_ptr<FitCheckpoint> checkpoint;
  error = OpenCheckpoint(problem, &checkpoint);
  if (!error.empty()) {
    return ReportError(error);
  }
  FitLog* const log = checkpoint ? &checkpoint->fit() : nullptr;
  const FitResult result = Fit(
      problem.options, &residuals,
      [&](int start, int iteration, const FitIteration& values) {
        PrintIteration(entries, start, iteration, values);
      },
      log);
  error = Mismatch(log);
  if (!error.empty()) {
    return ReportError(error);
  }
  DiscretisationCheck check;
  const bool checked = FLAGS_discretisation_check && result.status == FitStatus::kConverged;
  if (result.estimate.size() > 0) {
    PrintEstimates(entries, result);
    if (result.certificate.verdict != "trustworthy") {
      ReportError(file +
                  ": warning: not trustworthy at the estimate: " + result.certificate.verdict);
    }
  }
  if (checked) {
    FitLog* const half = checkpoint ? &checkpoint->half_step() : nullptr;
    check = CheckDiscretisation(problem, result, half);
    error = Mismatch(half);
    if (!error.empty()) {
      return ReportError(error);
    }
    PrintCheck(entries, check);
  }
  if (checkpoint && !checkpoint->error().empty()) {
    ReportError(checkpoint->error() + ": the fit went on without its checkpoint");
  }
  const int written = WriteFiles(fit, residuals, result, checked ? &check : nullptr);
  if (written != kExitDone) {
    return written;
  }
  if (result.status == FitStatus::kNoEffect) {
    return ReportError(file + ": /parameters/" + std::to_string(result.parameter) + ": " +
                       result.message);
  }
  if (result.status != FitStatus::kConverged) {
    return ReportError(file + ": " + NameOf(result.status) + ": " + result.message);
  }
  if (checked && check.status != FitStatus::kConverged) {
    return ReportError(file + ": the fit at dt / 2: " + NameOf(check.status) + ": " +
                       check.message);
  }
  // Said above: what was asked for is not there.
  return checkpoint && !checkpoint->error().empty() ? kExitFailed : kExitDone;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-fit",
       .synopsis = "FIT.json [--out=R.json] [--report=R.html] [--discretisation_check]\n"
                   "                    [--checkpoint=C.json]",
       .description =
           "Identifies parameters of a scene from observed positions by nonlinear least squares.\n"
           "Prints each iteration and, for each parameter, the estimate, its standard deviation\n"
           "and 95 % interval.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out", "report", "checkpoint"}});
  if (line.exit_status) return *line.exit_status;
  if (FLAGS_max_iterations < 1) {
    return ReportError("tangible-fit: --max_iterations: expected a number >= 1, got " +
                           std::to_string(FLAGS_max_iterations),
                       kExitUsage);
  }
  return Run(line.positional[0]);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
