// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/breakout_study.h"

#include <algorithm>
#include <mutex>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/math/median.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kMostNoOps = 30;
constexpr long kFirstPoints = 400, kLaterPoints = 1000;  // frames between points of a curve
constexpr long kFirstPart = 4000;                        // frames, with the closer points

// Tasks of a seed, in addition to those of the players.
constexpr unsigned kNoOpTask = 10, kStickyTask = 11, kPracticeTask = 12;

CurvePoint PointOf(const Agent& agent, long frames_seen, int score) {
  CurvePoint point;
  point.frames_seen = frames_seen;
  point.score = score;
  point.errors = ErrorsOf(agent.knowledge());
  if (agent.knowledge().paddle) point.numbers = NumbersOf(agent.knowledge().paddle->numbers());
  return point;
}

// Plays at random in separate games; returns the number of frames.
long Practise(const BreakoutCase& one, unsigned seed, int steps, Agent* agent,
              std::vector<CurvePoint>* curve) {
  BreakoutGame game({one.sticky, static_cast<unsigned>(Generator(seed, kPracticeTask)())});
  Picture picture;
  long frames = 0;
  curve->push_back(PointOf(*agent, 0, 0));
  for (int i = 0; i < steps;) {
    game.Reset(NoOpFrames(seed + 1));
    agent->StartGame();
    for (int reward = 0; i < steps && !game.over(); ++i) {
      game.Draw(&picture);
      reward = game.Step(agent->Act(picture, reward, game.lives()));
      frames += kFrameSkip;
      if (frames % kFirstPoints == 0) curve->push_back(PointOf(*agent, frames, 0));
    }
  }
  return frames;
}

}  // namespace

const char* NameOf(PlayerKind kind) {
  static constexpr const char* kNames[] = {"random", "follow", "intercept", "truth", "learned"};
  return kNames[static_cast<int>(kind)];
}

int NoOpFrames(unsigned seed) {
  std::mt19937_64 random = Generator(seed, kNoOpTask);
  return static_cast<int>(Uniform(&random) * (kMostNoOps + 1));
}

BreakoutResult PlayBreakout(const BreakoutCase& one, unsigned seed, long most_frames,
                            const GameWatcher& watch) {
  BreakoutResult result;
  result.seed = seed;
  result.no_op_frames = NoOpFrames(seed);
  std::unique_ptr<Agent> agent;
  Player player;
  long practised = 0;
  const bool learns = one.kind == PlayerKind::kLearned;
  if (learns || one.kind == PlayerKind::kTruth) {
    AgentOptions options;
    options.seed = seed;
    options.random_steps = learns ? one.random_frames / kFrameSkip : 0;
    if (!learns) options.given = TrueKnowledge();
    agent = std::make_unique<Agent>(options);
    practised = Practise(one, seed, options.random_steps, agent.get(), &result.curve);
    agent->StartGame();
    player = [&agent](const Picture& picture, double reward, int lives) {
      return agent->Act(picture, reward, lives);
    };
  } else {
    player = one.kind == PlayerKind::kRandom   ? RandomPlayer(seed)
             : one.kind == PlayerKind::kFollow ? FollowingPlayer()
                                               : InterceptingPlayer(seed);
  }
  BreakoutGame game({one.sticky, static_cast<unsigned>(Generator(seed, kStickyTask)())});
  game.Reset(result.no_op_frames);
  Picture picture;
  long next_point = 0;
  for (int reward = 0; !game.over() && game.frame() < most_frames;) {
    if (learns && game.frame() >= next_point) {
      result.curve.push_back(PointOf(*agent, practised + game.frame(), game.score()));
      next_point = game.frame() + (game.frame() < kFirstPart ? kFirstPoints : kLaterPoints);
    }
    game.Draw(&picture);
    if (watch) watch(game, agent.get());
    reward = game.Step(player(picture, reward, game.lives()));
    if (agent != nullptr && !agent->error().empty()) break;
  }
  if (watch) watch(game, agent.get());
  result.score = game.score();
  result.lives = game.lives();
  result.frames = game.frame();
  if (agent != nullptr) {
    result.error = agent->error();
    result.random_aims = agent->num_random_aims();
  }
  if (learns) result.curve.push_back(PointOf(*agent, practised + game.frame(), game.score()));
  return result;
}

BreakoutResults RunBreakout(const BreakoutStudyOptions& options,
                            const std::function<void(long, long)>& progress) {
  const int num_cases = static_cast<int>(options.cases.size());
  BreakoutResults results(options.cases.size(), std::vector<BreakoutResult>(options.games));
  std::mutex mutex;
  long done = 0;
  const int tasks = num_cases * options.games;
  // The cases of the same game follow each other, so that progress is steady.
  ForEachOnThreads(options.threads, tasks, [&](int task) {
    const int one = task % num_cases, number = task / num_cases;
    results[one][number] = PlayBreakout(
        options.cases[one], options.seed + static_cast<unsigned>(number), options.most_frames, {});
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done, tasks);
  });
  return results;
}

double MedianScore(const std::vector<BreakoutResult>& games) {
  if (games.empty()) return 0.0;
  std::vector<double> scores;
  scores.reserve(games.size());
  for (const BreakoutResult& game : games) scores.push_back(game.score);
  return Median(std::move(scores));
}

double MeanScore(const std::vector<BreakoutResult>& games) {
  if (games.empty()) return 0.0;
  double sum = 0.0;
  for (const BreakoutResult& game : games) sum += game.score;
  return sum / static_cast<double>(games.size());
}

}  // namespace tangible
