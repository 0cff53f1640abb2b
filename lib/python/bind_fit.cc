// SPDX-License-Identifier: Apache-2.0
//
// Fits: what tangible-fit does, and the residuals and Jacobians that it minimises.
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/recordings_json.h"
#include "tangible/estimation/results/report.h"
#include "tangible/python/binding.h"

namespace tangible::python {
namespace {

// A fit file of one run or several recordings, read. Calls change its memory: one at a time.
class FitProblemOf {
 public:
  FitProblemOf(const std::string& text, const std::string& file) {
    std::string error;
    const bool good = HasRecordings(text) ? ReadRecordings(text, file, &error)
                                          : ParseFit(text, file, &fit_, &error) &&
                                                MakeResiduals(fit_.problem, file, &run_, &error);
    if (!good) throw Error(error);
  }

  std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const auto& entry : problem().entries()) names.push_back(entry.name);
    return names;
  }

  // Columns: initial value, lower and upper bound.
  Array Ranges() {
    const auto& entries = problem().entries();
    Array ranges({static_cast<py::ssize_t>(entries.size()), py::ssize_t{3}});
    double* out = ranges.mutable_data();
    for (const auto& entry : entries) {
      *out++ = entry.initial;
      *out++ = entry.lower;
      *out++ = entry.upper;
    }
    return ranges;
  }

  py::tuple Evaluate(const Array& at, bool with_jacobian) {
    const BlockLayout layout(problem());
    const Eigen::Index count = layout.num_parameters();
    if (at.ndim() != 1 || at.shape(0) != count) {
      throw py::value_error("parameters: expected " + std::to_string(count) + " values");
    }
    const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(at.data(), count);
    Eigen::VectorXd values(layout.num_rows());
    RowMatrixXd jacobian = RowMatrixXd::Zero(with_jacobian ? layout.num_rows() : 0, count);
    const std::string error = WithoutLock(
        [&](SignalWatch* watch) { return EvaluateBlocks(layout, p, watch, &values, &jacobian); });
    if (!error.empty()) throw Error(error);
    const auto rows = static_cast<py::ssize_t>(values.size());
    return py::make_tuple(
        ToArray(RowMatrixXd(values), {rows}),
        with_jacobian ? py::object(ToArray(jacobian, {rows, count})) : py::object(py::none()));
  }

  // (the result as tangible-fit writes it, the report as a page)
  py::tuple Run(int max_iterations) {
    fit_.problem.options.max_iterations = max_iterations;
    std::string json;
    std::string report;
    WithoutLock([&](SignalWatch* watch) {
      const FitProgress progress = [watch](int, int, const FitIteration&) { watch->CheckNow(); };
      const FitOptions& options = fit_.problem.options;
      const FitResult result = recordings_ ? Fit(options, &*recordings_, progress)
                                           : Fit(options, &run_.front(), progress);
      OrderedJson all = recordings_ ? RecordingsResultToJson(*recordings_, result)
                                    : ResultToJson(run_.front(), result, nullptr);
      const bool any = result.estimate.size() > 0;
      all["certificate"] = any ? ToJson(result.certificate) : OrderedJson(nullptr);
      json = all.dump();
      if (any) {
        report = recordings_ ? RecordingsReport(fit_.path, *recordings_, result)
                             : FitReport(fit_.path, run_.front(), result, nullptr);
      }
      return 0;
    });
    return py::make_tuple(json, report);
  }

 private:
  LeastSquaresProblem& problem() {
    return recordings_ ? static_cast<LeastSquaresProblem&>(*recordings_) : run_.front();
  }

  bool ReadRecordings(const std::string& text, const std::string& file, std::string* error) {
    RecordingsFile read;
    std::vector<RecordedRun> runs;
    if (!ParseRecordings(text, file, &read, error) || !MakeRecordingsProblem(read, &runs, error)) {
      return false;
    }
    recordings_.emplace(std::move(runs), read.own);
    fit_.path = file;
    fit_.problem.options = read.recordings.front().fit.problem.options;
    return true;
  }

  // Rows of all blocks, each times the root of its weight; what is wrong, or empty. No Jacobian
  // where that has no rows.
  std::string EvaluateBlocks(const BlockLayout& layout, const Eigen::VectorXd& p,
                             SignalWatch* watch, Eigen::VectorXd* values, RowMatrixXd* jacobian) {
    const auto derivatives =
        jacobian->rows() > 0 ? BlockDerivatives::kCompute : BlockDerivatives::kSkip;
    for (int b = 0; b < layout.num_blocks(); ++b) {
      watch->CheckNow();
      BlockEvaluation block;
      if (!problem().EvaluateBlock(b, layout.Local(b, p), fit_.problem.options.derivatives,
                                   derivatives, &block)) {
        return block.message;
      }
      const double root = std::sqrt(problem().weight(b));
      const Eigen::Index first = layout.row_offset(b);
      values->segment(first, block.residuals.size()) = root * block.residuals;
      for (Eigen::Index k = 0; k < block.jacobian.cols(); ++k) {
        jacobian->col(layout.ParameterOf(b, static_cast<int>(k)))
            .segment(first, block.residuals.size()) = root * block.jacobian.col(k);
      }
    }
    return "";
  }

  FitFile fit_;
  std::vector<RolloutResiduals> run_;  // one, or none with recordings
  std::optional<RecordingsProblem> recordings_;
};

}  // namespace

void BindFit(py::module_* module) {
  py::class_<FitProblemOf>(*module, "Fit")
      .def(py::init<const std::string&, const std::string&>())
      .def_property_readonly("names", &FitProblemOf::names)
      .def("ranges", &FitProblemOf::Ranges)
      .def("evaluate", &FitProblemOf::Evaluate)
      .def("run", &FitProblemOf::Run);
}

}  // namespace tangible::python
