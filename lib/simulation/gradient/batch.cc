// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/batch.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "tangible/dynamics/model/settings.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/stepping/run_warnings.h"

namespace tangible {
namespace {

// What all rows share; nothing of it changes while they run.
struct Batch {
  const Scene& scene;
  const std::vector<ParameterPath>& parameters;
  const RowMatrixXd& values;
  const BatchOptions& options;
  std::vector<ParameterDirection> directions;
  std::shared_ptr<const ModelStructure> structure;
  std::vector<int> outputs;                             ///< pose and twist variables
  std::vector<int> loss_outputs;                        ///< of each term of the loss, into outputs
  BatchDerivative derivative = BatchDerivative::kNone;  ///< what auto stands for
};

BatchStatus StatusOf(StepStatus status) {
  switch (status) {
    case StepStatus::kDone:
      return BatchStatus::kDone;
    case StepStatus::kUnsolved:
      return BatchStatus::kUnsolved;
    case StepStatus::kDiverged:
      return BatchStatus::kDiverged;
  }
  return BatchStatus::kUnsolved;
}

// A thread's own scene, model and memory.
class Worker {
 public:
  explicit Worker(const Batch& batch) : batch_(batch), scene_(batch.scene) {
    BuildModelWithStructure(scene_, batch_.structure, &model_, &initial_);
    stepper_.emplace(model_);
  }

  void Run(Eigen::Index row, BatchRow* result) {
    result->message = SetParameters(batch_.parameters, batch_.values.row(row).data(), &scene_);
    if (!result->message.empty()) {
      scene_ = batch_.scene;  // half set
      BuildModelWithStructure(scene_, batch_.structure, &model_, &result->final);
      result->status = BatchStatus::kRefused;
      return;
    }
    BuildModelWithStructure(scene_, batch_.structure, &model_, &initial_);
    switch (batch_.derivative) {
      case BatchDerivative::kNone:
      case BatchDerivative::kAuto:  // chosen in Prepare
        result->report = Rollout(model_, initial_, {}, &*stepper_, &result->final);
        break;
      case BatchDerivative::kTangent:
        RunTangent(result);
        break;
      case BatchDerivative::kAdjoint:
        RunAdjoint(result);
        break;
    }
    result->status = StatusOf(result->report.status);
    result->message = result->report.message;
    if (result->status != BatchStatus::kDone) return;
    result->warnings = RunWarnings(model_, initial_).Finish(model_, result->report, result->final);
    if (!batch_.loss_outputs.empty()) result->loss = Loss(result->final);
  }

 private:
  double Output(const State<double>& state, int output) const {
    const int variable = batch_.outputs[output];
    const int poses = static_cast<int>(state.pose.size());
    return variable < poses ? state.pose[variable] : state.twist[variable - poses];
  }

  double Loss(const State<double>& state) const {
    double loss = 0.0;
    for (size_t i = 0; i < batch_.loss_outputs.size(); ++i) {
      const LossTerm& term = batch_.options.loss[i];
      const double error = Output(state, batch_.loss_outputs[i]) - term.target;
      loss += term.weight * error * error;
    }
    return loss;
  }

  // Derivatives of what is asked for with respect to the outputs: outputs x 1 for a loss.
  MatrixX<double> Seed(const State<double>& state) const {
    const auto count = static_cast<Eigen::Index>(batch_.outputs.size());
    if (batch_.loss_outputs.empty()) return MatrixX<double>::Identity(count, count);
    MatrixX<double> seed = MatrixX<double>::Zero(count, 1);
    for (size_t i = 0; i < batch_.loss_outputs.size(); ++i) {
      const LossTerm& term = batch_.options.loss[i];
      const int output = batch_.loss_outputs[i];
      seed(output, 0) += 2.0 * term.weight * (Output(state, output) - term.target);
    }
    return seed;
  }

  void Keep(RowMatrixXd derivative, BatchRow* result) const {
    if (batch_.loss_outputs.empty()) {
      result->jacobian = std::move(derivative);
    } else {
      result->gradient = derivative.row(0).transpose();
    }
  }

  void RunTangent(BatchRow* result) {
    RowMatrixXd w_dot = VariableJacobian(scene_, batch_.structure, batch_.directions).toDense();
    result->report = RolloutTangent(model_, initial_, {}, &*stepper_, &w_dot, &result->final);
    if (result->report.status != StepStatus::kDone) return;
    RowMatrixXd rows(static_cast<Eigen::Index>(batch_.outputs.size()), w_dot.cols());
    for (size_t i = 0; i < batch_.outputs.size(); ++i) {
      rows.row(static_cast<Eigen::Index>(i)) = w_dot.row(batch_.outputs[i]);
    }
    if (!batch_.loss_outputs.empty()) rows = (Seed(result->final).transpose() * rows).eval();
    Keep(std::move(rows), result);
  }

  void RunAdjoint(BatchRow* result) {
    const Eigen::SparseMatrix<double> map =
        VariableJacobian(scene_, batch_.structure, batch_.directions);
    result->report = tape_.Record(model_, initial_, Factorisations::kKeep, {}, &result->final);
    if (result->report.status != StepStatus::kDone) return;
    const MatrixX<double> seed = Seed(result->final);
    const long steps = tape_.steps();
    RowMatrixXd w_bar;
    tape_.Adjoint(
        model_, static_cast<int>(seed.cols()),
        [&](long k, RowMatrixXd* bar) {
          for (size_t i = 0; k == steps && i < batch_.outputs.size(); ++i) {
            bar->row(batch_.outputs[i]) += seed.row(static_cast<Eigen::Index>(i));
          }
        },
        &w_bar);
    Keep((map.transpose() * w_bar).transpose(), result);
  }

  const Batch& batch_;
  Scene scene_;
  Model<double> model_;
  State<double> initial_;
  std::optional<Stepper> stepper_;
  RolloutTape tape_;
};

BatchDerivative DerivativeOf(const Batch& batch) {
  if (batch.options.derivative != BatchDerivative::kAuto) return batch.options.derivative;
  const Differentiated what =
      batch.options.loss.empty() ? Differentiated::kFinalState : Differentiated::kLoss;
  const GradientMethod method = MethodOf({}, what, static_cast<long>(batch.parameters.size()),
                                         static_cast<long>(batch.outputs.size()));
  return method == GradientMethod::kTangent ? BatchDerivative::kTangent : BatchDerivative::kAdjoint;
}

// Fills what rows share; returns a message or empty.
std::string Prepare(Batch* batch) {
  std::string error;
  const auto columns = static_cast<Eigen::Index>(batch->parameters.size());
  if (batch->values.cols() != columns) {
    return "values: expected " + std::to_string(columns) + " columns, one a parameter, got " +
           std::to_string(batch->values.cols());
  }
  if (!CheckSettings(batch->scene.simulation, &error) ||
      !CheckApart(batch->scene, batch->parameters, &error)) {
    return error;
  }
  for (const ParameterPath& parameter : batch->parameters) {
    batch->directions.push_back(DirectionOf(parameter));
  }
  batch->structure = BuildStructure(batch->scene);
  batch->outputs = OutputVariables(*batch->structure);
  const std::vector<std::string> names = OutputNames(*batch->structure);
  for (const LossTerm& term : batch->options.loss) {
    const auto found = std::find(names.begin(), names.end(), term.output);
    if (found == names.end()) return "output " + term.output + ": no such output of the scene";
    batch->loss_outputs.push_back(static_cast<int>(found - names.begin()));
  }
  batch->derivative = DerivativeOf(*batch);
  return "";
}

int NumThreads(int asked, Eigen::Index rows) {
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  const Eigen::Index threads = asked > 0 ? asked : std::max(1, cores);
  return static_cast<int>(std::clamp<Eigen::Index>(threads, 1, std::max<Eigen::Index>(1, rows)));
}

}  // namespace

const char* NameOf(BatchStatus status) {
  switch (status) {
    case BatchStatus::kDone:
      return "done";
    case BatchStatus::kUnsolved:
      return "unsolved";
    case BatchStatus::kDiverged:
      return "diverged";
    case BatchStatus::kRefused:
      return "refused";
  }
  return "";
}

BatchResult RunBatch(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const RowMatrixXd& values, const BatchOptions& options,
                     const std::function<void(long done)>& progress) {
  BatchResult result;
  Batch batch{scene, parameters, values, options, {}, {}, {}, {}, {}};
  result.message = Prepare(&batch);
  result.derivative = batch.derivative;
  if (!result.message.empty()) return result;
  result.rows.resize(static_cast<size_t>(values.rows()));
  std::atomic<Eigen::Index> next{0};
  std::mutex mutex;
  long done = 0;
  std::exception_ptr thrown;
  const auto work = [&] {
    try {
      Worker worker(batch);
      for (Eigen::Index row = next++; row < values.rows(); row = next++) {
        worker.Run(row, &result.rows[static_cast<size_t>(row)]);
        const std::lock_guard<std::mutex> lock(mutex);
        ++done;
        if (progress) progress(done);
      }
    } catch (...) {  // no memory: the caller's thread says so
      const std::lock_guard<std::mutex> lock(mutex);
      thrown = std::current_exception();
      next = values.rows();
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < NumThreads(options.threads, values.rows()); ++i) {
      others.emplace_back(work);
    }
    work();
  }
  if (thrown) std::rethrow_exception(thrown);
  return result;
}

}  // namespace tangible
