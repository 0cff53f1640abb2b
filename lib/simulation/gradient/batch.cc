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
  /// `loss` is null where the derivative is that of the final state.
  Row(const OutputLoss* loss, BatchDerivative derivative) : loss_(loss), derivative_(derivative) {}

  void Run(const VectorX<double>& parameters, RolloutWorker* worker, BatchRow* result) const {
    const RolloutInput input{parameters, {}, {}};
    RolloutOutput output;
    GradientMethod used = GradientMethod::kAuto;
    if (derivative_ == BatchDerivative::kNone) {
      output = worker->Run(input);
    } else if (loss_ != nullptr && derivative_ == BatchDerivative::kAdjoint) {
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
    if (loss_ == nullptr) return;
    result->loss = loss_->Value(output.states.row(0).transpose());
    if (result->jacobian.size() > 0) {
      result->gradient = (Seed(output.states) * result->jacobian).transpose();
      result->jacobian.resize(0, 0);
    }
  }

 private:
  // Derivatives of the loss with respect to the outputs, as a row.
  RowMatrixXd Seed(const RowMatrixXd& states) const {
    return loss_->Derivative(states.row(0).transpose()).transpose();
  }

  const OutputLoss* loss_;
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
  OutputLoss loss;
  result.message = loss.Create(function.structure(), options.loss);
  if (!result.message.empty()) return result;
  const Row row(options.loss.empty() ? nullptr : &loss, result.derivative);
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
