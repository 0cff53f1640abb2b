// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/batch.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {
namespace {

// One row: values(r, :) of the parameters.
class Row {
 public:
  Row(const BatchOptions& options, const std::vector<int>& loss_outputs, BatchDerivative derivative)
      : options_(options), loss_outputs_(loss_outputs), derivative_(derivative) {}

  void Run(const VectorX<double>& parameters, RolloutWorker* worker, BatchRow* result) const {
    const RolloutInput input{parameters, {}, {}};
    const bool of_loss = !loss_outputs_.empty();
    RolloutOutput output;
    GradientMethod used = GradientMethod::kAuto;
    if (derivative_ == BatchDerivative::kNone) {
      output = worker->Run(input);
    } else if (of_loss && derivative_ == BatchDerivative::kAdjoint) {
      output = worker->Record(input);
      if (output.status == RolloutStatus::kDone) {
        result->gradient = worker->Adjoint({Seed(output.states)})[0].parameters;
      }
    } else {
      const GradientMethod method = derivative_ == BatchDerivative::kTangent
                                        ? GradientMethod::kTangent
                                        : GradientMethod::kAdjoint;
      output = worker->Jacobian(input, method, RolloutWorker::Inputs::kParameters,
                                &result->jacobian, &used);
    }
    result->status = output.status;
    result->message = std::move(output.message);
    result->report = output.report;
    result->final = std::move(output.final);
    if (result->status != RolloutStatus::kDone) {
      result->jacobian.resize(0, 0);
      return;
    }
    result->warnings = worker->Warnings(result->report, result->final);
    if (!of_loss) return;
    result->loss = Loss(output.states);
    if (result->jacobian.size() > 0) {
      result->gradient = (Seed(output.states) * result->jacobian).transpose();
      result->jacobian.resize(0, 0);
    }
  }

 private:
  double Loss(const RowMatrixXd& states) const {
    double loss = 0.0;
    for (size_t i = 0; i < loss_outputs_.size(); ++i) {
      const LossTerm& term = options_.loss[i];
      const double error = states(0, loss_outputs_[i]) - term.target;
      loss += term.weight * error * error;
    }
    return loss;
  }

  // Derivatives of the loss with respect to the outputs, as a row.
  RowMatrixXd Seed(const RowMatrixXd& states) const {
    RowMatrixXd seed = RowMatrixXd::Zero(1, states.cols());
    for (size_t i = 0; i < loss_outputs_.size(); ++i) {
      const LossTerm& term = options_.loss[i];
      const int output = loss_outputs_[i];
      seed(0, output) += 2.0 * term.weight * (states(0, output) - term.target);
    }
    return seed;
  }

  const BatchOptions& options_;
  const std::vector<int>& loss_outputs_;
  BatchDerivative derivative_;
};

BatchDerivative DerivativeOf(const BatchOptions& options, const RolloutFunction& function) {
  if (options.derivative != BatchDerivative::kAuto) return options.derivative;
  const Differentiated what =
      options.loss.empty() ? Differentiated::kFinalState : Differentiated::kLoss;
  const GradientMethod method =
      MethodOf({}, what, function.num_parameters(), function.num_states());
  return method == GradientMethod::kTangent ? BatchDerivative::kTangent : BatchDerivative::kAdjoint;
}

}  // namespace

BatchResult RunBatch(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const RowMatrixXd& values, const BatchOptions& options,
                     const std::function<void(long done)>& progress) {
  BatchResult result;
  if (values.cols() != static_cast<Eigen::Index>(parameters.size())) {
    result.message = "values: expected " + std::to_string(parameters.size()) +
                     " columns, one a parameter, got " + std::to_string(values.cols());
    return result;
  }
  std::vector<std::string> paths;
  paths.reserve(parameters.size());
  for (const ParameterPath& parameter : parameters) paths.push_back(parameter.path);
  RolloutFunction function;
  result.message = function.Create(scene, paths, {}, {});
  if (!result.message.empty()) return result;
  result.derivative = DerivativeOf(options, function);
  std::vector<int> loss_outputs;  // of each term
  const std::vector<std::string> names = OutputNames(function.structure());
  for (const LossTerm& term : options.loss) {
    const auto found = std::find(names.begin(), names.end(), term.output);
    if (found == names.end()) {
      result.message = "output " + term.output + ": no such output of the scene";
      return result;
    }
    loss_outputs.push_back(static_cast<int>(found - names.begin()));
  }
  const Row row(options, loss_outputs, result.derivative);
  result.rows.resize(static_cast<size_t>(values.rows()));
  std::mutex mutex;
  long done = 0;
  ForEachRollout(function, values.rows(), options.threads, [&](RolloutWorker* worker, long i) {
    row.Run(values.row(i).transpose(), worker, &result.rows[static_cast<size_t>(i)]);
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done);
  });
  return result;
}

}  // namespace tangible
