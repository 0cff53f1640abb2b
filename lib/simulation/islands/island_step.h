// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A step by events of a scene whose bodies are far apart: each island of the step
// (island_partition.h) is a model of its own, with its own segments, events and record, so that the
// cost of an event is that of its island. Islands meet at the boundaries of steps.
//
//   1. after a step with at most one event the bodies move together; an event that ends their
//      motion costs no more than to divide the step does
//   2. where another one is found the step is divided; islands without expected events move
//      together, and are divided too if two are found
//   3. a contact may make a body so fast that it moves farther than the division allows for: the
//      step is divided anew with the reach that was needed, or in the end not at all

#include <memory>
#include <vector>

#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/islands/island_partition.h"
#include "tangible/simulation/islands/island_record.h"

namespace tangible {

class IslandStepper {
 public:
  explicit IslandStepper(const Model<double>& model);

  StepReport Step(const Model<double>& model, double t, double h, State<double>* state);
  /// The record of the last step.
  const IslandRecords& record() const { return record_; }
  IslandRecords& mutable_record() { return record_; }

  /// Contacts of a guess are those of the whole model.
  void ClearGuess() { guess_.Clear(); }
  const EventGuess& guess() const { return guess_; }
  void SetGuess(const EventGuess& guess) { guess_ = guess; }

 private:
  StepReport StepWhole(const Model<double>& model, double t, double h, AtEvent at_event,
                       State<double>* state);
  StepReport StepDivided(const Model<double>& model, double t, double h, State<double>* state);
  void DistributeGuess();
  std::shared_ptr<const ModelPart> PartOf(const ModelStructure& structure, int island);
  enum class Result { kDone, kFailed, kStopped, kTooFar };
  Result StepIslands(const Model<double>& model, double t, double h, AtEvent at_event,
                     State<double>* state, StepReport* outcome);
  StepReport StepIsland(const Model<double>& model, double t, double h, int island,
                        AtEvent at_event, State<double>* state);
  bool KeepsReach(const IslandRecord& island);

  IslandPartition partition_;
  EventStepper large_;    ///< of the whole model, and of island 0
  EventStepper small_;    ///< of the other islands
  bool is_whole_ = true;  ///< large_ is set up for the whole model
  IslandRecords record_;
  EventGuess guess_, next_guess_;
  std::vector<EventGuess> guesses_;  ///< of the islands
  /// The part of each island by its first body, kept as long as the island exists; and that of
  /// island 0.
  std::vector<std::shared_ptr<const ModelPart>> parts_;
  std::shared_ptr<const ModelPart> together_;
  Model<double> model_;  ///< of an island
  State<double> own_state_, next_state_;
  std::vector<double> travelled_;
};

}  // namespace tangible
