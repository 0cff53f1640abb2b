// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How many frames it takes to learn Breakout, and how well it is then played: the agent after a
// number of frames of random play, beside players that learn nothing, in the same seeded games.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/experiments/breakout/baselines.h"
#include "tangible/estimation/experiments/breakout/game/breakout_game.h"
#include "tangible/estimation/experiments/breakout/true_knowledge.h"

namespace tangible {

enum class PlayerKind { kRandom, kFollow, kIntercept, kTruth, kLearned };
/// "random", "follow", "intercept", "truth", "learned".
const char* NameOf(PlayerKind kind);

/// One line of the table: one kind of player in all games.
struct BreakoutCase {
  PlayerKind kind = PlayerKind::kLearned;
  int random_frames = 1000;  ///< kLearned: of random play before the game, at 60 a second
  double sticky = 0.0;
};

struct BreakoutStudyOptions {
  std::vector<BreakoutCase> cases;
  int games = 20;
  unsigned seed = 1;                         ///< of the first game
  long most_frames = breakout::kMostFrames;  ///< of a game
  int threads = 0;                           ///< 0: one a core
};

/// The state of a game and of the knowledge after a number of frames.
struct CurvePoint {
  long frames_seen = 0;  ///< at 60 a second, of random play and of the game
  int score = 0;
  KnowledgeErrors errors;
  std::array<double, kNumPaddleNumbers> numbers{};  ///< of the paddle
};

struct BreakoutResult {
  unsigned seed = 0;
  int no_op_frames = 0;  ///< 0 to 30
  int score = 0;
  int lives = 0;                  ///< left
  long frames = 0;                ///< of the game
  long random_aims = 0;           ///< loops that were broken by chance
  std::vector<CurvePoint> curve;  ///< of players that learn
  std::string error;              ///< why the agent could not play
};

/// results[case][game]; `progress` is called with the number of games that are done and with that
/// of all, by one thread at a time.
using BreakoutResults = std::vector<std::vector<BreakoutResult>>;
BreakoutResults RunBreakout(const BreakoutStudyOptions& options,
                            const std::function<void(long, long)>& progress);

/// Called before each button is held, with the picture on the screen.
using GameWatcher = std::function<void(const BreakoutGame&, const Agent*)>;

/// One game of a case.
BreakoutResult PlayBreakout(const BreakoutCase& one, unsigned seed, long most_frames,
                            const GameWatcher& watch);

/// The number of frames without a button with which a seed's game begins.
int NoOpFrames(unsigned seed);

/// The median of the scores of games.
double MedianScore(const std::vector<BreakoutResult>& games);
double MeanScore(const std::vector<BreakoutResult>& games);

}  // namespace tangible
