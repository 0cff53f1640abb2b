// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/dynamics/model/state_variable.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible::closed_forms {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Outcome FromNumbers(const ClosedForm& form, const std::vector<Number>& outputs) {
  Outcome outcome;
  const auto rows = static_cast<Eigen::Index>(form.outputs.size());
  const auto cols = static_cast<Eigen::Index>(form.parameters.size());
  outcome.values.resize(rows);
  outcome.jacobian.resize(rows, cols);
  for (Eigen::Index i = 0; i < rows; ++i) {
    outcome.values[i] = outputs[i].a;
    outcome.jacobian.row(i) = outputs[i].v.head(cols).transpose();
  }
  return outcome;
}

struct Run {
  std::string message;
  State<double> final;
  RowMatrixXd jacobian;  // state variables x parameters
};

Run RunAdjoint(const Model<double>& model, const State<double>& initial,
               const std::vector<int>& variables, const Eigen::SparseMatrix<double>& map) {
  Run run;
  RolloutTape tape;
  const RolloutReport report = tape.Record(model, initial, Factorisations::kKeep, {}, &run.final);
  run.message = report.message;
  if (report.status != StepStatus::kDone) return run;
  const long last = tape.steps();
  RowMatrixXd w_bar;
  tape.Adjoint(
      model, static_cast<int>(variables.size()),
      [&](long k, RowMatrixXd* bar) {
        for (size_t i = 0; k == last && i < variables.size(); ++i) {
          (*bar)(variables[i], static_cast<Eigen::Index>(i)) += 1.0;
        }
      },
      &w_bar);
  run.jacobian = (map.transpose() * w_bar).transpose();
  return run;
}

Run RunTangent(const Model<double>& model, const State<double>& initial,
               const std::vector<int>& variables, const Eigen::SparseMatrix<double>& map) {
  Run run;
  RowMatrixXd w_dot = map.toDense();
  const RolloutReport report = RolloutTangent(model, initial, {}, &w_dot, &run.final);
  run.message = report.message;
  if (report.status != StepStatus::kDone) return run;
  run.jacobian.resize(static_cast<Eigen::Index>(variables.size()), map.cols());
  for (size_t i = 0; i < variables.size(); ++i) {
    run.jacobian.row(static_cast<Eigen::Index>(i)) = w_dot.row(variables[i]);
  }
  return run;
}

struct Entry {
  double got, exact;
  std::string name;
};

// The largest |got − exact|, over `scale`; raises `over_bound`.
double LargestError(const std::vector<Entry>& entries, Errors* errors) {
  double scale = 0.0, largest = 0.0;
  for (const Entry& entry : entries) scale = std::max(scale, std::abs(entry.exact));
  if (scale == 0.0) scale = 1.0;
  for (const Entry& entry : entries) {
    const double difference = std::abs(entry.got - entry.exact);
    const double error =
        std::isnan(difference) ? std::numeric_limits<double>::infinity() : difference;
    largest = std::max(largest, error);
    const double over = error / (1e-9 * std::abs(entry.exact) + 1e-13 * scale);
    if (over > errors->over_bound) {
      errors->over_bound = over;
      errors->worst = entry.name;
    }
  }
  return largest / scale;
}

}  // namespace

std::vector<Scheme> AllSchemes() {
  return {{"fixed", Stepping::kFixed, Integrator::kSemiImplicitEuler},
          {"event, trapezoidal", Stepping::kEvent, Integrator::kTrapezoidal},
          {"event, runge_kutta_4", Stepping::kEvent, Integrator::kRungeKutta4}};
}

Outcome Exact(const ClosedForm& form) {
  return FromNumbers(form, form.exact(SeededParameters(form)));
}

Outcome Simulate(const ClosedForm& form, const Scheme& scheme, int steps, Method method) {
  PreparedScene prepared = Prepare(form);
  SimulationSettings& settings = prepared.scene.simulation;
  settings.stepping = scheme.stepping;
  settings.integrator = scheme.integrator;
  settings.dt = settings.duration / steps;
  std::vector<ParameterDirection> directions;
  for (const auto& direction : prepared.directions) {
    ParameterDirection& numbers = directions.emplace_back();
    for (const auto& [number, weight] : direction) numbers.push_back({number, weight});
  }
  const std::shared_ptr<const ModelStructure> structure = BuildStructure(prepared.scene);
  Model<double> model;
  State<double> initial;
  BuildModelWithStructure(prepared.scene, structure, &model, &initial);
  const Eigen::SparseMatrix<double> map = VariableJacobian(prepared.scene, structure, directions);
  const std::vector<int> variables = OutputVariables(*structure);
  const Run run =
      (method == Method::kAdjoint ? RunAdjoint : RunTangent)(model, initial, variables, map);
  if (!run.message.empty()) {
    Outcome failed;
    failed.message = run.message;
    return failed;
  }
  FinalState state(variables.size());
  for (size_t i = 0; i < variables.size(); ++i) {
    state[i].a = StateNumber(run.final, variables[i]);
    state[i].v.setZero();
    state[i].v.head(map.cols()) = run.jacobian.row(static_cast<Eigen::Index>(i)).transpose();
  }
  Outcome outcome = FromNumbers(form, form.read(SeededParameters(form), state));
  for (size_t k = 0; k < form.parameters.size(); ++k) {
    if (form.parameters[k].first == "T") {
      outcome.jacobian.col(static_cast<Eigen::Index>(k)).setConstant(kNan);
    }
  }
  return outcome;
}

Errors Compare(const ClosedForm& form, const Outcome& got, const Outcome& exact) {
  std::vector<Entry> values, derivatives;
  for (Eigen::Index i = 0; i < exact.values.size(); ++i) {
    values.push_back({got.values[i], exact.values[i], form.outputs[i]});
    for (Eigen::Index k = 0; k < exact.jacobian.cols(); ++k) {
      if (form.parameters[k].first == "T" || std::isnan(exact.jacobian(i, k))) continue;
      derivatives.push_back({got.jacobian(i, k), exact.jacobian(i, k),
                             "d " + form.outputs[i] + " / d " + form.parameters[k].first});
    }
  }
  Errors errors;
  errors.value = LargestError(values, &errors);
  errors.derivative = LargestError(derivatives, &errors);
  return errors;
}

double Order(const std::vector<double>& dt, const std::vector<double>& error, double floor) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (size_t i = 0; i < dt.size(); ++i) {
    if (!(error[i] > floor)) continue;
    const double u = std::log(dt[i]), v = std::log(error[i]);
    n += 1.0;
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
  }
  return n < 3.0 ? kNan : (n * xy - x * y) / (n * xx - x * x);
}

Study RunStudy(const ClosedForm& form, const Scheme& scheme, const std::vector<int>& steps) {
  // A smaller error is rounding and gives no information about the order.
  constexpr double kFloor = 1e-11;
  Study study{form.name, form.kind, scheme.name, {}, {}, {}, "", kNan, kNan};
  const Outcome exact = Exact(form);
  std::vector<double> value_errors, derivative_errors;
  const bool instant = form.instant > 0.0;
  const double duration = Prepare(form).scene.simulation.duration;
  for (const int n : instant ? std::vector<int>{1} : steps) {
    const Outcome got = Simulate(form, scheme, n, Method::kAdjoint);
    if (!got.message.empty()) {
      study.message = got.message;
      return study;
    }
    study.steps.push_back(n);
    study.dt.push_back(duration / n);
    study.errors.push_back(Compare(form, got, exact));
    value_errors.push_back(study.errors.back().value);
    derivative_errors.push_back(study.errors.back().derivative);
  }
  study.value_order = Order(study.dt, value_errors, kFloor);
  study.derivative_order = Order(study.dt, derivative_errors, kFloor);
  return study;
}

}  // namespace tangible::closed_forms
