// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_adjoint.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tangible/math/interrupt.h"

namespace tangible {

void RolloutTape::Start(const Model<double>& model, const TapeOptions& options) {
  options_ = options;
  total_ = NumSteps(model.structure->settings);
  steps_ = steps_again_ = 0;
  first_ = 0;
  record_from_ = 0;
  spacing_ = 0;
  checkpoints_.clear();
  checkpoint_bytes_ = entry_bytes_ = used_bytes_ = peak_bytes_ = 0;
  for (const std::unique_ptr<Entry>& entry : entries_) {
    entry->counted = 0;  // until it is counted again
  }
  last_record_bytes_ = last_factor_bytes_ = most_record_bytes_ = 0;
  if (!stepper_ || structure_ != model.structure) {
    stepper_ = std::make_unique<Stepper>(model);
    structure_ = model.structure;
    entries_.clear();
  }
  used_ = 0;
  if (options.checkpointing.kind == Checkpointing::Kind::kEvery) {
    spacing_ = std::max(1L, options.checkpointing.every);
    record_from_ = total_ > 0 ? (total_ - 1) / spacing_ * spacing_ : 0;
    ReleaseEntries(static_cast<size_t>(std::min(spacing_, total_)));
  } else if (by_budget()) {
    ReleaseEntries(0);
  }
  for (const std::unique_ptr<Entry>& entry : entries_) {
    Count(entry.get());
  }
}

RolloutReport RolloutTape::Record(ControlledModel<double> model, const State<double>& initial,
                                  const TapeOptions& options, const StateObserver& observer,
                                  State<double>* final) {
  Start(model.At(0), options);
  const StateObserver record = [&](long k, double t, const State<double>& state, Stepper* stepper) {
    if (observer) {
      observer(k, t, state, stepper);
    }
    RecordStep(model.At(std::max(0L, k - 1)), k, state);
  };
  return Rollout(model, initial, record, stepper_.get(), final);
}

// Called after k steps of the first run, the last of which the stepper still holds.
void RolloutTape::RecordStep(const Model<double>& model, long k, const State<double>& state) {
  steps_ = k;
  if (k > record_from_) {
    if (used_ == 0) {
      first_ = k - 1;
    }
    Take(model, total_ - k);
    if (by_budget() && k == 1) {
      PlanByBudget(state);
    }
  }
  const bool bounded = options_.checkpointing.kind != Checkpointing::Kind::kAll;
  if (bounded && k < total_ && (k == 0 || (spacing_ > 0 && k % spacing_ == 0))) {
    AddCheckpoint(MakeCheckpoint(k, state), Origin::kRun);
  }
  if (by_budget()) {
    MakeRoom();
  }
  peak_bytes_ = std::max(peak_bytes_, held_bytes());
}

// Keeps the first run within its budget.
void RolloutTape::MakeRoom() {
  if (held_bytes() > budget() && !entries_.empty()) {
    // The sweep will run these steps again.
    used_ = 0;
    ReleaseEntries(0);
    record_from_ = record_from_ == 0 ? (total_ - 1) / spacing_ * spacing_ : total_;
  }
  if (checkpoint_bytes_ > budget() / 2 && checkpoints_.size() > 2) {
    // There are more checkpoints than planned: every other one is kept.
    spacing_ *= 2;
    RemoveCheckpoints([this](long step, Origin) { return step % spacing_ != 0; });
    record_from_ =
        record_from_ == 0 ? 0 : std::min(record_from_, (total_ - 1) / spacing_ * spacing_);
  }
}

// Plans after the first step, from its memory. Whether all records fit is found out only when they
// do not.
void RolloutTape::PlanByBudget(const State<double>& state) {
  const size_t checkpoint = MakeCheckpoint(1, state).bytes();
  const auto least_memory = [&](size_t record) {
    return 2.0 * std::sqrt(static_cast<double>(total_) * static_cast<double>(checkpoint) *
                           static_cast<double>(record));
  };
  const size_t with_factors = last_record_bytes_ + last_factor_bytes_;
  const bool room = 2.0 * least_memory(with_factors) <= static_cast<double>(budget());
  spacing_ = CheckpointSpacing(total_, checkpoint, room ? with_factors : last_record_bytes_);
}

Checkpoint RolloutTape::MakeCheckpoint(long step, const State<double>& state) const {
  Checkpoint checkpoint;
  checkpoint.step = step;
  checkpoint.state = state;
  stepper_->SaveGuess(&checkpoint.guess);
  return checkpoint;
}

void RolloutTape::AddCheckpoint(Checkpoint checkpoint, Origin origin) {
  checkpoint_bytes_ += checkpoint.bytes();
  const auto place = std::upper_bound(
      checkpoints_.begin(), checkpoints_.end(), checkpoint.step,
      [](long step, const std::pair<Checkpoint, Origin>& c) { return step < c.first.step; });
  checkpoints_.emplace(place, std::move(checkpoint), origin);
}

void RolloutTape::RemoveCheckpoints(const std::function<bool(long step, Origin origin)>& which) {
  std::erase_if(checkpoints_, [&](const std::pair<Checkpoint, Origin>& c) {
    if (!which(c.first.step, c.second)) {
      return false;
    }
    checkpoint_bytes_ -= c.first.bytes();
    return true;
  });
}

// Whether the stepper's factors fit beside the records of `remaining` further steps, with a reserve
// of an eighth, because all steps are run again if records do not fit in the end.
bool RolloutTape::HasRoomForFactors(long remaining) const {
  const size_t record = last_record_bytes_ + last_record_bytes_ / 8;
  return checkpoint_bytes_ + used_bytes_ + last_factor_bytes_ +
             record * static_cast<size_t>(remaining + 1) <=
         budget();
}

// The stepper's last step becomes the next entry; `remaining` steps follow it.
void RolloutTape::Take(const Model<double>& model, long remaining) {
  if (used_ == entries_.size()) {
    entries_.push_back(std::make_unique<Entry>());
  }
  Entry& entry = *entries_[used_++];
  stepper_->Take(model,
                 options_.factorisations == Factorisations::kKeep &&
                     (!by_budget() || HasRoomForFactors(remaining)),
                 &entry);
  if (!entry.has_factors && by_budget()) entry.DropFactors();
  Count(&entry);
  if (entry.has_factors) {
    KeepWithinBudget(&entry);
  }
}

// The entry may exceed the plan: a step with more contacts than those before it, or whose factors
// needed memory for solves.
void RolloutTape::KeepWithinBudget(Entry* entry) {
  if (!by_budget()) {
    return;
  }
  Recount(entry);
  if (held_bytes() > budget()) {
    entry->DropFactors();  // the sweep will factorise anew
    Recount(entry);
  }
}

// Adds an entry's memory to the sums; without checkpoints they are not used.
void RolloutTape::Count(Entry* entry) {
  if (options_.checkpointing.kind == Checkpointing::Kind::kAll) {
    return;
  }
  const size_t bytes = entry->bytes();
  entry_bytes_ += bytes - entry->counted;
  entry->counted = bytes;
  if (used_ > 0) {
    used_bytes_ = used_ == 1 ? bytes : used_bytes_ + bytes;
    if (entry->has_factors || last_factor_bytes_ == 0) {
      last_factor_bytes_ = entry->factor_bytes();
    }
    last_record_bytes_ = bytes - entry->factor_bytes();
    most_record_bytes_ = std::max(most_record_bytes_, last_record_bytes_);
  }
  if (by_budget() && held_bytes() > budget()) {
    ReleaseEntries(used_);
  }
}

// Releases the memory of all entries but the first `keep`.
void RolloutTape::ReleaseEntries(size_t keep) {
  while (entries_.size() > keep) {
    entry_bytes_ -= entries_.back()->counted;
    entries_.pop_back();
  }
}

// The factors of an event step or of a projection have needed memory for the sweep's solves. Where
// that exceeds the budget, the steps from this one on, with which the sweep is done, are released;
// another sweep runs them again.
void RolloutTape::ReleaseSwept(long step) {
  if (!by_budget()) {
    return;
  }
  Entry* entry = entries_[static_cast<size_t>(step - first_)].get();
  Recount(entry);
  if (held_bytes() > budget()) {
    used_ = static_cast<size_t>(step - first_);
    ReleaseEntries(used_);
    used_bytes_ = entry_bytes_;
  }
}

void RolloutTape::Recount(Entry* entry) {
  const size_t bytes = entry->bytes();
  used_bytes_ += bytes - entry->counted;
  entry_bytes_ += bytes - entry->counted;
  entry->counted = bytes;
}

// Fills the entries with the steps up to `last`, starting from the checkpoint before it or, where
// these steps exceed the budget, from a new checkpoint in between.
void RolloutTape::RunAgain(ControlledModel<double>* model, long last) {
  RemoveCheckpoints(
      [last](long step, Origin origin) { return origin == Origin::kSplit && step >= last; });
  const auto next = std::lower_bound(
      checkpoints_.begin(), checkpoints_.end(), last,
      [](const std::pair<Checkpoint, Origin>& c, long step) { return c.first.step < step; });
  const Checkpoint& from = std::prev(next)->first;
  stepper_->SetGuess(from.guess);
  State<double> state = from.state;
  const SimulationSettings& settings = model->structure().settings;
  used_ = 0;
  used_bytes_ = 0;
  first_ = from.step;
  for (long k = from.step; k < last; ++k) {
    if (by_budget() && used_ > 0 &&
        checkpoint_bytes_ + used_bytes_ + most_record_bytes_ > budget()) {
      AddCheckpoint(MakeCheckpoint(k, state), Origin::kSplit);
      used_ = 0;
      used_bytes_ = 0;
      first_ = k;
    }
    const Model<double>& now = model->At(k);
    if (stepper_->Step(now, StepTime(settings, k), StepLength(settings, k), &state).status !=
        StepStatus::kDone) {
      throw std::logic_error("RolloutTape: the model is not that of the recorded run");
    }
    ++steps_again_;
    Take(now, last - k - 1);
    peak_bytes_ = std::max(peak_bytes_, held_bytes());
  }
}

void RolloutTape::AdjointFrom(ControlledModel<double> model, long last, int num_losses,
                              const Seed& seed, RowMatrixXd* w_bar, const ControlSink& sink,
                              const EventSeed& event_seed) {
  const ModelStructure& structure = model.structure();
  w_bar->setZero(structure.num_variables(), num_losses);
  RowMatrixXd controls_bar;
  const auto hand_over = [&](long step) {
    if (!model.is_controlled()) return;
    const std::vector<int>& numbers = model.controls()->numbers;
    controls_bar.resize(static_cast<Eigen::Index>(numbers.size()), num_losses);
    for (size_t j = 0; j < numbers.size(); ++j) {
      auto row = w_bar->row(structure.ParameterVariable(numbers[j]));
      controls_bar.row(static_cast<Eigen::Index>(j)) = row;
      row.setZero();
    }
    if (sink) sink(step, controls_bar);
  };
  for (long k = std::min(last, steps()); k > 0; --k) {
    CheckInterrupt();
    seed(k, w_bar);
    const long step = k - 1;
    if (step < first_ || step >= first_ + static_cast<long>(used_)) {
      RunAgain(&model, k);
    }
    Entry& entry = *entries_[static_cast<size_t>(step - first_)];
    const Model<double>& now = model.At(step);
    if (event_seed) event_seed(step, &entry.parts);
    stepper_->Adjoint(now, &entry, w_bar);
    if (entry.has_factors) KeepWithinBudget(&entry);
    ReleaseSwept(step);
    hand_over(step);
  }
  seed(0, w_bar);
}

size_t RolloutTape::bytes() const {
  size_t sum = checkpoint_bytes_;
  for (const std::unique_ptr<Entry>& entry : entries_) {
    sum += entry->bytes();
  }
  return sum;
}

}  // namespace tangible
