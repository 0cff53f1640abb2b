// SPDX-License-Identifier: Apache-2.0
//
// Fits: what tangible-fit does, and the residuals and Jacobians that it minimises.
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/report.h"
#include "tangible/python/binding.h"

namespace tangible::python {
namespace {

// A fit file of one run or several recordings, read. Calls change its memory, and take turns.
class FitProblemOf {
 public:
  FitProblemOf(const std::string& text, const std::string& file) : text_(text), file_(file) {
    std::string error;
    if (ParseFit(text, file, &fit_, &error)) problem_ = MakeProblem(fit_, &error);
    if (problem_ == nullptr) throw Error(error);
  }

  const std::string& text() const { return text_; }
  const std::string& file() const { return file_; }

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
        [&] { return turns_.Take([&] { return EvaluateBlocks(layout, p, &values, &jacobian); }); });
    if (!error.empty()) throw Error(error);
    const auto rows = static_cast<py::ssize_t>(values.size());
    return py::make_tuple(
        ToArray(RowMatrixXd(values), {rows}),
        with_jacobian ? py::object(ToArray(jacobian, {rows, count})) : py::object(py::none()));
  }

  // (the result as tangible-fit writes it, the report as a page)
  py::tuple Run(int max_iterations) {
    const auto [json, report] =
        WithoutLock([&] { return turns_.Take([&] { return Texts(max_iterations); }); });
    return py::make_tuple(json, report);
  }

 private:
  RecordingsProblem& problem() { return *problem_; }

  // What Run returns.
  std::pair<std::string, std::string> Texts(int max_iterations) {
    fit_.run().options.max_iterations = max_iterations;
    const FitProgress progress = [](int, int, const FitIteration&) { CheckInterrupt(); };
    VarianceComponents components;
    const FitResult result =
        FitWithComponents(fit_.input.options(), problem_.get(), progress, &components);
    OrderedJson all = ResultToJson(*problem_, result, {&components});
    const bool any = result.estimate.size() > 0;
    all["certificate"] = any ? ToJson(result.certificate) : OrderedJson(nullptr);
    return {all.dump(),
            any ? FitReport(fit_.path, *problem_, result, {&components}) : std::string()};
  }

  // Rows of all blocks, each times the root of its weight; what is wrong, or empty. No Jacobian
  // where that has no rows.
  std::string EvaluateBlocks(const BlockLayout& layout, const Eigen::VectorXd& p,
                             Eigen::VectorXd* values, RowMatrixXd* jacobian) {
    const auto derivatives =
        jacobian->rows() > 0 ? BlockDerivatives::kCompute : BlockDerivatives::kSkip;
    for (int b = 0; b < layout.num_blocks(); ++b) {
      CheckInterrupt();
      BlockEvaluation block;
      if (!problem().EvaluateBlock(b, layout.Local(b, p), fit_.input.options().derivatives,
                                   derivatives, &block)) {
        return problem().BlockName(b) + block.message;
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

  std::string text_, file_;
  FitFile fit_;
  std::unique_ptr<RecordingsProblem> problem_;
  Turns turns_;
};

}  // namespace

void BindFit(py::module_* module) {
  py::class_<FitProblemOf>(*module, "Fit")
      .def(py::init<const std::string&, const std::string&>())
      .def(
          py::pickle([](const FitProblemOf& fit) { return py::make_tuple(fit.text(), fit.file()); },
                     [](const py::tuple& state) {
                       return std::make_unique<FitProblemOf>(state[0].cast<std::string>(),
                                                             state[1].cast<std::string>());
                     }))
      .def_property_readonly("names", &FitProblemOf::names)
      .def("ranges", &FitProblemOf::Ranges)
      .def("evaluate", &FitProblemOf::Evaluate)
      .def("run", &FitProblemOf::Run);
}

}  // namespace tangible::python
