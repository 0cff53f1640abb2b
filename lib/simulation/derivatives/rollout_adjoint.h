// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The adjoint of a rollout (reverse mode): from the derivatives of one or several losses with
// respect to states along the run to those with respect to all variables w = [initial poses |
// initial twists | parameters].
//
//   each step, backwards   x̄ = v̄⁺ + h q̄⁺,   Kᵀ u = x̄,   w̄ −= (∂R/∂w)ᵀ u      (equation_jacobian.h)
//
// The forward run is recorded on a tape: per step the state, contacts, modes and impulses, and, if
// kept, the factorisation; otherwise it is recomputed on the way back. With checkpoints the tape
// holds the records of one segment of the run at a time (checkpoint.h), which is run again with the
// same bits.

#include <algorithm>
#include <memory>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/simulation/derivatives/checkpoint.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

enum class Factorisations {
  kKeep,       ///< fastest; about ten times the memory of the states
  kRecompute,  ///< one more assembly and factorisation for each step
};

struct TapeOptions {
  // NOLINTNEXTLINE(google-explicit-constructor): what is kept is often all that is asked for
  TapeOptions(Factorisations kept = Factorisations::kKeep, Checkpointing checkpoints = {})
      : factorisations(kept), checkpointing(checkpoints) {}

  Factorisations factorisations;
  /// With a budget, factorisations are kept as long as memory remains for them.
  Checkpointing checkpointing;
};

class RolloutTape {
 public:
  /// Runs and records. The observer is called as in Rollout.
  RolloutReport Record(ControlledModel<double> model, const State<double>& initial,
                       const TapeOptions& options, const StateObserver& observer,
                       State<double>* final);

  /// Adds to w_bar the derivatives of the losses with respect to the state after k steps; called
  /// from the last k to 0. Rows of poses and twists are those of that state.
  using Seed = std::function<void(long k, RowMatrixXd* w_bar)>;

  /// Called with step k and the derivatives with respect to the controls' values in it: a row for
  /// each entry of Controls::numbers, a column for each loss.
  using ControlSink = std::function<void(long k, const RowMatrixXd& controls_bar)>;

  /// Called before the sweep through step k by events, whose segments may be given the derivatives
  /// of the losses with respect to the times of their ends (Segment::end_bar).
  using EventSeed = std::function<void(long k, IslandRecords* parts)>;

  /// The reverse sweep from the state after `last` steps, for losses that depend on no later state:
  /// w_bar, num_variables x num_losses, gets the derivatives with respect to the initial poses,
  /// twists and the numbers; the rows of controls' parameters are 0. Chain with
  /// VariableJacobian(...)ᵀ w_bar for user parameters. `model` has the numbers of the recorded run.
  void AdjointFrom(ControlledModel<double> model, long last, int num_losses, const Seed& seed,
                   RowMatrixXd* w_bar, const ControlSink& sink = {},
                   const EventSeed& event_seed = {});
  /// The same from the end.
  void Adjoint(const ControlledModel<double>& model, int num_losses, const Seed& seed,
               RowMatrixXd* w_bar) {
    AdjointFrom(model, steps(), num_losses, seed, w_bar);
  }

  /// Memory of the tape now, and its maximum since Record began, bytes.
  size_t bytes() const;
  size_t peak_bytes() const { return std::max(peak_bytes_, bytes()); }
  long steps() const { return steps_; }
  /// How many steps were run again since Record.
  long steps_again() const { return steps_again_; }

 private:
  struct Entry : StepTape {
    size_t counted = 0;  ///< its bytes as contained in the tape's sums
  };
  enum class Origin : unsigned char { kRun, kSplit };
  bool by_budget() const { return options_.checkpointing.kind == Checkpointing::Kind::kBudget; }
  size_t budget() const { return options_.checkpointing.budget; }
  size_t held_bytes() const { return entry_bytes_ + checkpoint_bytes_; }
  void Start(const Model<double>& model, const TapeOptions& options);
  void RecordStep(const Model<double>& model, long k, const State<double>& state);
  void PlanByBudget(const State<double>& state);
  void MakeRoom();
  Checkpoint MakeCheckpoint(long step, const State<double>& state) const;
  void AddCheckpoint(Checkpoint checkpoint, Origin origin);
  void RemoveCheckpoints(const std::function<bool(long step, Origin origin)>& which);
  void Take(const Model<double>& model, long remaining);
  bool HasRoomForFactors(long remaining) const;
  void KeepWithinBudget(Entry* entry);
  void ReleaseSwept(long step);
  void Recount(Entry* entry);
  void Count(Entry* entry);
  void ReleaseEntries(size_t keep);
  void RunAgain(ControlledModel<double>* model, long last);

  TapeOptions options_;
  long total_ = 0;                               ///< steps of a whole run
  long steps_ = 0, steps_again_ = 0;             ///< done
  std::vector<std::unique_ptr<Entry>> entries_;  ///< reused from run to run
  size_t used_ = 0;
  long first_ = 0;  ///< the used entries are those of steps first_, first_ + 1, ...
  std::vector<std::pair<Checkpoint, Origin>> checkpoints_;  ///< ascending
  long spacing_ = 0;                                        ///< of checkpoints, steps; 0: none
  long record_from_ = 0;  ///< the first run records steps from here on
  // With checkpoints: sums of bytes; the bytes of the last entry, with its factors counted
  // separately, and the maximum.
  size_t entry_bytes_ = 0, used_bytes_ = 0, checkpoint_bytes_ = 0, peak_bytes_ = 0;
  size_t last_record_bytes_ = 0, last_factor_bytes_ = 0, most_record_bytes_ = 0;
  std::unique_ptr<Stepper> stepper_;
  std::shared_ptr<const ModelStructure> structure_;  ///< of stepper_ and the entries
};

}  // namespace tangible
