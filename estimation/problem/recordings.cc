// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/recordings.h"

#include <set>
#include <utility>

namespace tangible {

RecordingsProblem::RecordingsProblem(std::vector<RecordedRun> recordings, std::vector<bool> own)
    : recordings_(std::move(recordings)) {
  for (size_t i = 0; i < own.size(); ++i) {
    (own[i] ? own_ : shared_).push_back(static_cast<int>(i));
  }
  order_ = shared_;
  order_.insert(order_.end(), own_.begin(), own_.end());
  for (const int i : shared_) {
    entries_.push_back(recordings_.front().residuals.entries()[i]);
  }
  for (const RecordedRun& recording : recordings_) {
    for (const int i : own_) {
      ParameterEntry entry = recording.residuals.entries()[i];
      entry.name += " of " + recording.name;
      entries_.push_back(std::move(entry));
    }
  }
}

int RecordingsProblem::ParameterOf(int recording, int i) const {
  for (size_t k = 0; k < shared_.size(); ++k) {
    if (shared_[k] == i) return static_cast<int>(k);
  }
  for (size_t k = 0; k < own_.size(); ++k) {
    if (own_[k] == i) {
      return num_shared() + recording * num_own(recording) + static_cast<int>(k);
    }
  }
  return -1;
}

Eigen::VectorXd RecordingsProblem::ParametersOf(int recording, const Eigen::VectorXd& p) const {
  Eigen::VectorXd ordered(static_cast<Eigen::Index>(order_.size()));
  for (Eigen::Index i = 0; i < ordered.size(); ++i) {
    ordered[i] = p[ParameterOf(recording, static_cast<int>(i))];
  }
  return ordered;
}

Eigen::VectorXd RecordingsProblem::Ordered(const Eigen::VectorXd& local) const {
  Eigen::VectorXd ordered(local.size());
  for (size_t k = 0; k < order_.size(); ++k) {
    ordered[order_[k]] = local[static_cast<Eigen::Index>(k)];
  }
  return ordered;
}

std::vector<RowPlace> RecordingsProblem::Places(int block) const {
  return recordings_[block].residuals.Places(0);
}

bool RecordingsProblem::EvaluateBlock(int block, const Eigen::VectorXd& p, DerivativeMethod method,
                                      BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  if (!recordings_[block].residuals.EvaluateBlock(0, Ordered(p), method, derivatives, evaluation)) {
    evaluation->message = BlockName(block) + evaluation->message;
    return false;
  }
  if (derivatives == BlockDerivatives::kCompute) {
    const RowMatrixXd ordered = evaluation->jacobian(Eigen::all, order_);
    evaluation->jacobian = ordered;
  }
  return true;
}

std::optional<Certificate> RecordingsProblem::Certify(const Eigen::VectorXd& p) {
  std::optional<Certificate> all;
  for (int block = 0; block < num_blocks(); ++block) {
    std::optional<Certificate> one = recordings_[block].residuals.Certify(ParametersOf(block, p));
    if (!one) continue;
    for (std::string* reason : {&one->margin_where, &one->coordinates, &one->smoothed,
                                &one->one_sided, &one->discontinuous}) {
      if (!reason->empty()) *reason = BlockName(block) + *reason;
    }
    if (all) {
      Merge(*one, *all);
    } else {
      all = std::move(one);
    }
  }
  if (all) SetVerdict(*all);
  return all;
}

HeldColumns RecordingsProblem::EvaluateHeld(int block, const Eigen::VectorXd& p,
                                            DerivativeMethod method, int most) {
  return recordings_[block].residuals.EvaluateHeld(0, Ordered(p), method, most);
}

// An inconsistency of shared parameters occurs in all recordings, and is reported once.
std::vector<std::string> RecordingsProblem::FindInconsistencies(const Eigen::VectorXd& p) {
  std::vector<std::string> lines;
  std::set<std::string> told;
  for (int block = 0; block < num_blocks(); ++block) {
    for (const std::string& line :
         recordings_[block].residuals.FindInconsistencies(ParametersOf(block, p))) {
      if (told.insert(line).second) lines.push_back(BlockName(block) + line);
    }
  }
  return lines;
}

std::unique_ptr<LeastSquaresProblem> RecordingsProblem::Window(double part) const {
  std::vector<RecordedRun> early;
  for (const RecordedRun& recording : recordings_) {
    early.push_back({recording.name, recording.weight, recording.residuals.FirstPart(part)});
  }
  std::vector<bool> own(order_.size(), false);
  for (const int i : own_) own[i] = true;
  return std::make_unique<RecordingsProblem>(std::move(early), own);
}

}  // namespace tangible
