// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/recordings.h"

#include <algorithm>
#include <set>
#include <utility>

namespace tangible {

RecordingsProblem::RecordingsProblem(std::vector<RecordedRun> recordings,
                                     std::vector<ParameterScope> scopes)
    : recordings_(std::move(recordings)), scopes_(std::move(scopes)) {
  for (size_t i = 0; i < scopes_.size(); ++i) {
    const int parameter = static_cast<int>(i);
    if (scopes_[i].kind != ParameterScope::Kind::kOwn) {
      shared_.push_back(parameter);
      order_.push_back(scopes_[i].kind == ParameterScope::Kind::kVaries ? -1 : parameter);
    }
    if (scopes_[i].kind != ParameterScope::Kind::kShared) own_.push_back(parameter);
  }
  order_.insert(order_.end(), own_.begin(), own_.end());
  AddEntries();
  AddEffects();
}

RecordingsProblem::RecordingsProblem(RolloutResiduals residuals) {
  scopes_.resize(residuals.entries().size());
  for (int i = 0; i < residuals.num_parameters(); ++i) shared_.push_back(i);
  order_ = shared_;
  recordings_.push_back({"", 1.0, std::move(residuals)});
  AddEntries();
}

void RecordingsProblem::AddEntries() {
  for (const int i : shared_) {
    entries_.push_back(recordings_.front().residuals.entries()[i]);
  }
  for (const RecordedRun& recording : recordings_) {
    for (const int i : own_) {
      ParameterEntry entry = recording.residuals.entries()[i];
      if (IsNamed()) entry.name += " of " + recording.name;
      // What is known beforehand of a parameter that varies is known of the shared value.
      if (scopes_[i].kind == ParameterScope::Kind::kVaries) entry.prior.reset();
      entries_.push_back(std::move(entry));
    }
  }
}

void RecordingsProblem::AddEffects() {
  for (size_t k = 0; k < shared_.size(); ++k) {
    const int i = shared_[k];
    const ParameterScope& scope = scopes_[i];
    if (scope.kind != ParameterScope::Kind::kVaries) continue;
    RandomEffect effect;
    effect.name = entries_[k].name;
    effect.kind = scope.distribution;
    effect.mean = static_cast<int>(k);
    for (int block = 0; block < num_blocks(); ++block) effect.own.push_back(ParameterOf(block, i));
    const double wide = effect.kind == PriorKind::kLogNormal ? 1.0 : entries_[k].scale;
    effect.spread = scope.spread.value_or(wide);
    effects_.push_back(std::move(effect));
    effect_parameters_.push_back(i);
  }
}

int RecordingsProblem::ParameterOf(int recording, int i) const {
  for (size_t k = 0; k < own_.size(); ++k) {
    if (own_[k] == i) {
      return num_shared() + recording * num_own(recording) + static_cast<int>(k);
    }
  }
  for (size_t k = 0; k < shared_.size(); ++k) {
    if (shared_[k] == i) return static_cast<int>(k);
  }
  return -1;
}

int RecordingsProblem::IndexInRecording(int k) const {
  const int own = k - num_shared();
  return own < 0 ? shared_[k] : own_[own % num_own(0)];
}

int RecordingsProblem::RecordingOf(int k) const {
  const int own = k - num_shared();
  return own < 0 ? -1 : own / num_own(0);
}

Eigen::VectorXd RecordingsProblem::ParametersOf(int recording, const Eigen::VectorXd& p) const {
  Eigen::VectorXd ordered(static_cast<Eigen::Index>(scopes_.size()));
  for (Eigen::Index i = 0; i < ordered.size(); ++i) {
    ordered[i] = p[ParameterOf(recording, static_cast<int>(i))];
  }
  return ordered;
}

Eigen::VectorXd RecordingsProblem::Ordered(const Eigen::VectorXd& local) const {
  Eigen::VectorXd ordered(static_cast<Eigen::Index>(scopes_.size()));
  for (size_t k = 0; k < order_.size(); ++k) {
    if (order_[k] >= 0) ordered[order_[k]] = local[static_cast<Eigen::Index>(k)];
  }
  return ordered;
}

void RecordingsProblem::SetInitial(const Eigen::VectorXd& p) {
  for (size_t k = 0; k < entries_.size(); ++k) {
    entries_[k].initial =
        std::clamp(p[static_cast<Eigen::Index>(k)], entries_[k].lower, entries_[k].upper);
  }
  for (int block = 0; block < num_blocks(); ++block) {
    recordings_[block].residuals.SetInitial(ParametersOf(block, p));
  }
}

void RecordingsProblem::SetHuber(double huber) {
  for (RecordedRun& recording : recordings_) recording.residuals.SetHuber(huber);
}

std::vector<RowPlace> RecordingsProblem::Places(int block) const {
  return recordings_[block].residuals.Places(0);
}

bool RecordingsProblem::EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                                      BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  if (!recordings_[block].residuals.EvaluateBlock(0, Ordered(p), method, derivatives, evaluation)) {
    return false;
  }
  if (derivatives == BlockDerivatives::kCompute && order_ != shared_) {
    RowMatrixXd ordered =
        RowMatrixXd::Zero(evaluation->jacobian.rows(), static_cast<Eigen::Index>(order_.size()));
    for (size_t k = 0; k < order_.size(); ++k) {
      if (order_[k] >= 0) {
        ordered.col(static_cast<Eigen::Index>(k)) = evaluation->jacobian.col(order_[k]);
      }
    }
    evaluation->jacobian = std::move(ordered);
  }
  return true;
}

std::optional<Certificate> RecordingsProblem::Certify(const Eigen::VectorXd& p) {
  std::optional<Certificate> all;
  for (int block = 0; block < num_blocks(); ++block) {
    std::optional<Certificate> one = recordings_[block].residuals.Certify(ParametersOf(block, p));
    if (!one) continue;
    for (std::string* reason : {&one->margin_where, &one->coordinates, &one->one_sided,
                                &one->discontinuous, &one->discrete_map, &one->discrete_impact}) {
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

void RecordingsProblem::AddRadii(const Eigen::VectorXd& p, Certificate* certificate) {
  if (static_cast<size_t>(num_blocks()) * entries().size() > kMostRadiusRuns) return;
  for (int block = 0; block < num_blocks(); ++block) {
    Certificate one;
    recordings_[block].residuals.AddRadii(ParametersOf(block, p), &one);
    for (size_t i = 0; i < one.radius.size(); ++i) {
      ValidityRadius& radius = one.radius[i];
      radius.parameter = entries_[ParameterOf(block, static_cast<int>(i))].name;
      for (std::string* where : {&radius.down_where, &radius.up_where}) {
        if (!where->empty()) *where = BlockName(block) + *where;
      }
    }
    Merge(one, *certificate);
  }
  SetVerdict(*certificate);
}

HeldColumns RecordingsProblem::EvaluateHeld(int block, const Eigen::VectorXd& p,
                                            GradientMethod method, int most) {
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
  if (HasNoise()) return nullptr;
  std::vector<RecordedRun> early;
  for (const RecordedRun& recording : recordings_) {
    early.push_back({recording.name, recording.weight, recording.residuals.FirstPart(part)});
  }
  return std::make_unique<RecordingsProblem>(std::move(early), scopes_);
}

std::unique_ptr<LeastSquaresProblem> RecordingsProblem::Released(const std::string& path) const {
  if (HasNoise()) return nullptr;
  std::vector<RecordedRun> runs;
  for (const RecordedRun& recording : recordings_) {
    std::optional<RolloutResiduals> with = recording.residuals.With(path);
    if (!with) {
      return nullptr;
    }
    // One shared parameter would change a number that differs from recording to recording.
    if (!runs.empty() &&
        with->entries().back().initial != runs.front().residuals.entries().back().initial) {
      return nullptr;
    }
    runs.push_back({recording.name, recording.weight, std::move(*with)});
  }
  std::vector<ParameterScope> scopes = scopes_;
  scopes.emplace_back();
  auto released = std::make_unique<RecordingsProblem>(std::move(runs), std::move(scopes));
  for (size_t e = 0; e < effects_.size(); ++e) {
    released->SetSpread(static_cast<int>(e), effects_[e].spread);
  }
  return released;
}

}  // namespace tangible
