// SPDX-License-Identifier: Apache-2.0
//
// Many evaluations of one function, on several threads.
#include <algorithm>
#include <atomic>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

void ForEachRollout(const RolloutFunction& function, long count, int threads,
                    const std::function<void(RolloutWorker* worker, long i)>& work) {
  const int used = static_cast<int>(std::min<long>(NumThreads(threads), std::max(1L, count)));
  WorkerPool pool(used);
  std::vector<std::optional<RolloutWorker>> workers(static_cast<size_t>(used));
  pool.Run(static_cast<size_t>(count), used, [&](size_t i, int thread) {
    std::optional<RolloutWorker>& worker = workers[static_cast<size_t>(thread)];
    if (!worker) worker.emplace(function);
    work(&*worker, static_cast<long>(i));
  });
}

std::vector<RolloutOutput> RolloutBatch::Run(const std::vector<RolloutInput>& inputs) const {
  std::vector<RolloutOutput> outputs(inputs.size());
  ForEachRollout(function_, static_cast<long>(inputs.size()), threads_,
                 [&](RolloutWorker* worker, long i) { outputs[i] = worker->Run(inputs[i]); });
  return outputs;
}

std::vector<RolloutOutput> RolloutBatch::Tangent(const std::vector<RolloutInput>& inputs,
                                                 const std::vector<InputDirection>& directions,
                                                 std::vector<RowMatrixXd>* tangents) const {
  std::vector<RolloutOutput> outputs(inputs.size());
  tangents->resize(inputs.size());
  ForEachRollout(function_, static_cast<long>(inputs.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   std::vector<RowMatrixXd> one;
                   outputs[i] = worker->Tangent(inputs[i], {directions[i]}, &one);
                   (*tangents)[i] = std::move(one[0]);
                 });
  return outputs;
}

std::vector<RolloutOutput> RolloutBatch::Record(std::vector<RolloutInput> inputs) {
  inputs_ = std::move(inputs);
  std::vector<RolloutOutput> outputs(inputs_.size());
  tapes_.resize(inputs_.size());
  std::atomic<size_t> bytes{0};
  ForEachRollout(function_, static_cast<long>(inputs_.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   if (bytes >= kTapeBudget) {
                     tapes_[i].reset();
                     outputs[i] = worker->Run(inputs_[i]);
                     return;
                   }
                   if (tapes_[i] == nullptr) {
                     tapes_[i] = std::make_unique<RolloutWorker>(function_);
                   }
                   outputs[i] = tapes_[i]->Record(inputs_[i]);
                   bytes += tapes_[i]->tape().bytes();
                 });
  statuses_.clear();
  for (const RolloutOutput& output : outputs) statuses_.push_back(output.status);
  return outputs;
}

std::vector<InputDirection> RolloutBatch::Adjoint(const std::vector<RowMatrixXd>& bars) {
  std::vector<InputDirection> results(inputs_.size());
  ForEachRollout(function_, static_cast<long>(inputs_.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   if (statuses_[i] != RolloutStatus::kDone) {
                     constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
                     results[i].parameters.setConstant(function_.num_parameters(), kNan);
                     results[i].state.setConstant(function_.num_states(), kNan);
                     results[i].controls.setConstant(inputs_[i].controls.rows(),
                                                     inputs_[i].controls.cols(), kNan);
                     return;
                   }
                   if (tapes_[i] == nullptr) worker->Record(inputs_[i]);
                   RolloutWorker* const recorded = tapes_[i] == nullptr ? worker : tapes_[i].get();
                   results[i] = recorded->Adjoint({bars[i]})[0];
                 });
  return results;
}

std::vector<Certificate> RolloutBatch::Certify(const std::vector<RolloutInput>& inputs) const {
  std::vector<Certificate> certificates(inputs.size());
  ForEachRollout(
      function_, static_cast<long>(inputs.size()), threads_,
      [&](RolloutWorker* worker, long i) { certificates[i] = worker->Certify(inputs[i]); });
  return certificates;
}

}  // namespace tangible
