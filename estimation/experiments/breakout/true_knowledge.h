// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What is true of the game, in the words of the agent: to play with, and to compare with what was
// learned.

#include "tangible/estimation/experiments/breakout/agent/agent.h"

namespace tangible {

/// Everything that can be learned, from the game itself.
Knowledge TrueKnowledge();

struct KnowledgeErrors {
  /// Of the paddle's way in a step, root mean square over all sequences of three buttons, pixels.
  double paddle_way = 0.0;
  /// The share of returns, over all places on both paddles, speeds and directions, whose velocity
  /// is expected wrong.
  double returns = 0.0;
  /// The share of bricks, over rows and speeds, after which another speed is expected.
  double bricks = 0.0;
  /// The share of rows whose points are not known.
  double points = 0.0;
};
KnowledgeErrors ErrorsOf(const Knowledge& knowledge);

}  // namespace tangible
