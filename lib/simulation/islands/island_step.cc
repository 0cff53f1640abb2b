// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_step.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tangible {
namespace {

// How often a step is divided anew because a body has moved farther than its reach.
constexpr int kMostDivisions = 3;
// The reach after that, as a multiple of how far the body has moved.
constexpr double kNewReach = 1.5;

}  // namespace

IslandStepper::IslandStepper(const Model<double>& model)
    : partition_(model), large_(model), small_(model) {
  parts_.resize(model.structure->bodies.size());
  travelled_.resize(model.structure->bodies.size());
}

StepReport IslandStepper::Step(const Model<double>& model, double t, double h,
                               State<double>* state) {
  record_.time = t;
  record_.h = h;
  if (guess_.starts) {
    // A run may have shapes of other sizes than the run before it.
    partition_ = IslandPartition(model);
    is_whole_ = false;
  }
  if (!partition_.MayDivide()) {
    return StepWhole(model, t, h, AtEvent::kGoOn, state);
  }
  if (guess_.located < 2) {
    next_guess_ = guess_;
    next_state_ = *state;
    const AtEvent at_event = guess_.connected ? AtEvent::kGoOn : AtEvent::kStopAtSecond;
    StepReport outcome = StepWhole(model, t, h, at_event, &next_state_);
    if (!outcome.stopped) {
      std::swap(*state, next_state_);
      return outcome;
    }
    std::swap(guess_, next_guess_);
  }
  return StepDivided(model, t, h, state);
}

StepReport IslandStepper::StepDivided(const Model<double>& model, double t, double h,
                                      State<double>* state) {
  using Together = IslandPartition::Together;
  partition_.FindReach(model, *state, t, h);
  Together together = Together::kWithoutExpected;
  for (int divisions = 0; divisions < kMostDivisions;) {
    partition_.Divide(model, *state, guess_);
    partition_.List(*model.structure, together);
    if (!partition_.IsDivided()) {
      together = Together::kWithout;
      partition_.List(*model.structure, together);
    }
    guess_.connected = !partition_.IsDivided();
    if (guess_.connected) break;
    StepReport outcome;
    next_state_ = *state;
    const AtEvent at_event =
        together == Together::kWithout ? AtEvent::kGoOn : AtEvent::kStopAtSecond;
    const Result result = StepIslands(model, t, h, at_event, &next_state_, &outcome);
    if (result == Result::kDone) {
      AdvanceKinematic(model, record_, &next_state_);
      std::swap(*state, next_state_);
      std::swap(guess_, next_guess_);
      return outcome;
    }
    // A step that fails is done again as a whole, which tells why.
    if (result == Result::kFailed) break;
    if (result == Result::kStopped) together = Together::kWithout;
    divisions += result == Result::kTooFar ? 1 : 0;
  }
  return StepWhole(model, t, h, AtEvent::kGoOn, state);
}

StepReport IslandStepper::StepWhole(const Model<double>& model, double t, double h,
                                    AtEvent at_event, State<double>* state) {
  if (!std::exchange(is_whole_, true)) {
    large_.Retarget(model);
  }
  record_.Clear();
  IslandRecord* island = record_.Add();
  std::swap(large_.mutable_guess(), guess_);
  std::swap(large_.mutable_record(), island->events);
  StepReport outcome = large_.Step(model, t, h, state, at_event);
  std::swap(large_.mutable_record(), island->events);
  std::swap(large_.mutable_guess(), guess_);
  return outcome;
}

// The part of an island, which is that of an earlier step if it has the same bodies.
std::shared_ptr<const ModelPart> IslandStepper::PartOf(const ModelStructure& structure,
                                                       int island) {
  const std::vector<int>& bodies = partition_.bodies(island);
  int first = bodies.front();
  for (size_t k = 0; structure.bodies[first].block < 0; ++k) {
    first = bodies[k];
  }
  std::shared_ptr<const ModelPart>& part = island == 0 ? together_ : parts_[first];
  const bool is_same = part != nullptr && part->bodies.size() == bodies.size() + 1 &&
                       std::equal(bodies.begin(), bodies.end(), part->bodies.begin());
  if (!is_same) {
    part = std::make_shared<const ModelPart>(TakePart(structure, bodies));
  }
  return part;
}

// Each island's share of the guess; contacts remain those of the whole model.
void IslandStepper::DistributeGuess() {
  guesses_.resize(std::max(guesses_.size(), static_cast<size_t>(partition_.num_islands())));
  for (EventGuess& guess : guesses_) {
    guess.Clear();
    guess.starts = guess_.starts;
  }
  const auto island_of = [&](const ActiveContact& contact) {
    return std::max(partition_.IslandOf(contact.a), partition_.IslandOf(contact.b));
  };
  for (size_t i = 0; i < guess_.contacts.size(); ++i) {
    if (const int island = island_of(guess_.contacts[i]); island >= 0) {
      guesses_[island].contacts.push_back(guess_.contacts[i]);
      guesses_[island].modes.push_back(guess_.modes[i]);
    }
  }
  for (const BrokenLimit& broken : guess_.broken_limits) {
    if (const int island = island_of(broken.limit); island >= 0) {
      guesses_[island].broken_limits.push_back(broken);
    }
  }
}

// Steps every island, island 0 first, which stops if `at_event` says so.
IslandStepper::Result IslandStepper::StepIslands(const Model<double>& model, double t, double h,
                                                 AtEvent at_event, State<double>* state,
                                                 StepReport* outcome) {
  record_.Clear();
  next_guess_.Clear();
  next_guess_.starts = false;
  DistributeGuess();
  outcome->pairs_compared = partition_.num_compared();
  bool keeps_reach = true;
  for (int island = 0; island < partition_.num_islands(); ++island) {
    if (partition_.bodies(island).empty()) continue;
    const StepReport own =
        StepIsland(model, t, h, island, island == 0 ? at_event : AtEvent::kGoOn, state);
    if (own.status != StepStatus::kDone) return Result::kFailed;
    if (own.stopped) return Result::kStopped;
    outcome->Add(own);
    keeps_reach = KeepsReach(*record_.islands[record_.num_islands - 1]) && keeps_reach;
  }
  outcome->islands = record_.num_islands;
  return keeps_reach ? Result::kDone : Result::kTooFar;
}

StepReport IslandStepper::StepIsland(const Model<double>& model, double t, double h, int island,
                                     AtEvent at_event, State<double>* state) {
  IslandRecord* record = record_.Add();
  record->part = PartOf(*model.structure, island);
  const Model<double>& own = record->ModelOf(model, &model_);
  record->part->GatherState(*state, &own_state_);
  EventStepper& stepper = island == 0 ? large_ : small_;
  is_whole_ = is_whole_ && island != 0;
  stepper.Retarget(own);
  EventGuess& guess = guesses_[island];
  // A contact with a fixed body that is no longer near keeps a place, but is like no other.
  for (ActiveContact& contact : guess.contacts) {
    contact = record->InIsland(contact);
  }
  for (BrokenLimit& broken : guess.broken_limits) {
    broken.limit = record->InIsland(broken.limit);
  }
  std::swap(stepper.mutable_guess(), guess);
  std::swap(stepper.mutable_record(), record->events);
  StepReport outcome = stepper.Step(own, t, h, &own_state_, at_event);
  std::swap(stepper.mutable_record(), record->events);
  std::swap(stepper.mutable_guess(), guess);
  for (size_t i = 0; i < guess.contacts.size(); ++i) {
    if (guess.contacts[i].a < 0 || guess.contacts[i].b < 0) continue;
    next_guess_.contacts.push_back(record->InWhole(guess.contacts[i]));
    next_guess_.modes.push_back(guess.modes[i]);
  }
  for (const BrokenLimit& broken : guess.broken_limits) {
    next_guess_.broken_limits.push_back({record->InWhole(broken.limit), broken.steps});
  }
  next_guess_.located += guess.located;
  record->part->ScatterState(own_state_, state);
  return outcome;
}

// Whether the island's bodies have stayed within their reach, by the bound on speeds that the
// search for events uses; sets a larger one for those that have not.
bool IslandStepper::KeepsReach(const IslandRecord& island) {
  const ModelPart& part = *island.part;
  bool keeps = true;
  for (const int k : part.structure->moving) {
    travelled_[k] = 0.0;
  }
  for (int p = 0; p < island.events.num_parts; ++p) {
    const EventPart& event_part = *island.events.parts[p];
    if (event_part.is_impulses) continue;
    const Segment& segment = event_part.segment;
    for (const int k : part.structure->moving) {
      const int body = part.bodies[k];
      double moved[3];
      for (int i = 0; i < 3; ++i) {
        moved[i] = segment.after.pose[3 * k + i] - segment.before.pose[3 * k + i];
      }
      travelled_[k] +=
          std::max(partition_.SpeedOf(body, moved),
                   segment.length *
                       LargestSpeedBetween(partition_.SpeedOf(body, &segment.before.twist[3 * k]),
                                           partition_.SpeedOf(body, &segment.after.twist[3 * k])));
    }
  }
  for (const int k : part.structure->moving) {
    const int body = part.bodies[k];
    if (travelled_[k] > partition_.reach(body)) {
      partition_.SetReach(body, kNewReach * travelled_[k]);
      keeps = false;
    }
  }
  return keeps;
}

}  // namespace tangible
