// SPDX-License-Identifier: Apache-2.0
//
// Fits: what tangible-fit does, and the residuals and Jacobians that it minimises.
#include "tangible/app/certificate_json.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/report.h"
#include "tangible/python/binding.h"

namespace tangible::python {
namespace {

// A fit file, read, with its residuals. Calls change its memory: one at a time.
class FitProblemOf {
 public:
  FitProblemOf(const std::string& text, const std::string& file) {
    std::string error;
    if (!ParseFit(text, file, &fit_, &error) ||
        !MakeResiduals(fit_.problem, file, &residuals_, &error)) {
      throw Error(error);
    }
  }

  RolloutResiduals& residuals() { return residuals_.front(); }

  std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const auto& entry : residuals().scene().entries()) names.push_back(entry.name);
    return names;
  }

  // Columns: initial value, lower and upper bound.
  Array Ranges() {
    const auto& entries = residuals().scene().entries();
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
    const Eigen::Index count = residuals().num_parameters();
    if (at.ndim() != 1 || at.shape(0) != count) {
      throw py::value_error("parameters: expected " + std::to_string(count) + " values");
    }
    const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(at.data(), count);
    Eigen::VectorXd values;
    RowMatrixXd jacobian;
    const bool good = WithoutLock([&](SignalWatch*) {
      return residuals().Evaluate(p, fit_.problem.options.derivatives, &values,
                                  with_jacobian ? &jacobian : nullptr);
    });
    if (!good) throw Error(residuals().message());
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
      const FitResult result = Fit(fit_.problem.options, &residuals(),
                                   [watch](int, int, const FitIteration&) { watch->CheckNow(); });
      OrderedJson all = ResultToJson(residuals(), result, nullptr);
      const bool any = result.estimate.size() > 0;
      all["certificate"] = any ? ToJson(result.certificate) : OrderedJson(nullptr);
      json = all.dump();
      if (any) report = FitReport(fit_.path, residuals(), result, nullptr);
      return 0;
    });
    return py::make_tuple(json, report);
  }

 private:
  FitFile fit_;
  std::vector<RolloutResiduals> residuals_;
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
