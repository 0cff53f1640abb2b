// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Checkpoints of a rollout: the steps from which it can be run again with the same bits, and their
// spacing, so that its adjoint needs a bounded memory.
//
// With a checkpoint every k of N steps (c bytes each) and the records of one segment of k steps (r
// bytes each), which are computed again when the reverse sweep reaches it,
//
//   memory   c N / k + r k,   least 2 √(N c r) at k = √(N c / r)
//   cost     one more rollout, except for the last segment
//
// Where a segment's records do not fit (steps that have more contacts than the first), it is split
// by further checkpoints, and runs twice. Source: A. Griewank, A. Walther, Evaluating Derivatives,
// 2nd ed., SIAM 2008, ch. 12.

#include <string>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

struct Checkpointing {
  enum class Kind {
    kAll,     ///< every step's record is kept
    kEvery,   ///< a checkpoint every `every` steps
    kBudget,  ///< as fast as `budget` bytes allow
  };
  Kind kind = Kind::kAll;
  long every = 0;
  size_t budget = 0;  ///< bytes
};

/// Reads "all", "every:K" (K ≥ 1 steps) or "budget:MIB" (MIB > 0, in 2^20 bytes); false with the
/// expected form if it is none of these.
bool ParseCheckpointing(const std::string& text, Checkpointing* checkpointing, std::string* error);

/// The state after `step` steps, and everything else from which the next step starts.
struct Checkpoint {
  long step = 0;
  State<double> state;
  StepperGuess guess;

  size_t bytes() const;
};

/// The spacing of least memory, in [1, steps]: √(steps checkpoint / record), rounded.
long CheckpointSpacing(long steps, size_t checkpoint_bytes, size_t record_bytes);

}  // namespace tangible
