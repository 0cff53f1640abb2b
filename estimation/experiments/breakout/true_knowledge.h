// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The true values of what the agent learns about the game, in the agent's form: to play with, and
// to compare with the learned values.

#include "tangible/estimation/experiments/breakout/agent/agent.h"

namespace tangible {

/// The complete knowledge, from the game itself.
Knowledge TrueKnowledge();

struct KnowledgeErrors {
  /// The error of the paddle's displacement in a step, root mean square over all sequences of three
  /// buttons, pixels.
  double paddle_way = 0.0;
  /// The fraction of returns, over all places on both paddles, speeds and directions, whose
  /// predicted velocity is wrong.
  double returns = 0.0;
  /// The fraction of bricks, over rows and speeds, after which the predicted speed is wrong.
  double bricks = 0.0;
  /// The fraction of rows whose points are not known.
  double points = 0.0;
};
KnowledgeErrors ErrorsOf(const Knowledge& knowledge);

}  // namespace tangible
