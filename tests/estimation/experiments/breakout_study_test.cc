// SPDX-License-Identifier: Apache-2.0
//
// Whole games: what is true of the game is known to it, the agent learns it, and baselines play.

#include "tangible/estimation/experiments/breakout/breakout_study.h"

#include <gtest/gtest.h>

#include "tangible/estimation/experiments/breakout/replay.h"

namespace tangible {
namespace {

constexpr long kPartOfAGame = 8000;  // frames

TEST(BreakoutStudy, TheTruthHasNoErrors) {
  const KnowledgeErrors errors = ErrorsOf(TrueKnowledge());
  // The means of three buttons' ways do not know of more than three.
  EXPECT_LT(errors.paddle_way, 0.5);
  EXPECT_EQ(errors.returns, 0.0);
  EXPECT_EQ(errors.bricks, 0.0);
  EXPECT_EQ(errors.points, 0.0);
  const KnowledgeErrors first = ErrorsOf(Knowledge());
  EXPECT_GT(first.paddle_way, 3.0);
  EXPECT_GT(first.returns, 0.5);
  EXPECT_GT(first.bricks, 0.2);
}

TEST(BreakoutStudy, TheAgentLearnsThePaddleAtRandomAndTheBallInTheGame) {
  const BreakoutResult game = PlayBreakout({PlayerKind::kLearned, 1000, 0.0}, 1, kPartOfAGame, {});
  EXPECT_EQ(game.error, "");
  EXPECT_GT(game.score, 100);
  EXPECT_EQ(game.curve.front().frames_seen, 0);
  EXPECT_EQ(game.curve.back().frames_seen, 1000 + game.frames);
  const CurvePoint* start = nullptr;
  for (const CurvePoint& point : game.curve) {
    if (start == nullptr && point.frames_seen >= 1000) start = &point;
  }
  ASSERT_NE(start, nullptr);
  EXPECT_LT(start->errors.paddle_way, 1.0);
  EXPECT_LT(game.curve.back().errors.returns, start->errors.returns);
  EXPECT_LT(game.curve.back().errors.bricks, start->errors.bricks);
}

TEST(BreakoutStudy, ASeedRepeatsItsGameOnAnyNumberOfThreads) {
  BreakoutStudyOptions options;
  options.cases = {{PlayerKind::kLearned, 200, 0.25}, {PlayerKind::kIntercept, 0, 0.25}};
  options.games = 2;
  options.most_frames = 2000;
  options.threads = 1;
  const BreakoutResults one = RunBreakout(options, {});
  options.threads = 2;
  const BreakoutResults two = RunBreakout(options, {});
  bool differ = false;
  for (size_t i = 0; i < one.size(); ++i) {
    for (size_t j = 0; j < one[i].size(); ++j) {
      EXPECT_EQ(one[i][j].score, two[i][j].score);
      EXPECT_EQ(one[i][j].frames, two[i][j].frames);
      EXPECT_EQ(one[i][j].curve.size(), two[i][j].curve.size());
    }
    differ = differ || one[i][0].no_op_frames != one[i][1].no_op_frames;
  }
  EXPECT_TRUE(differ);
  EXPECT_EQ(one[0][0].curve.back().errors.paddle_way, two[0][0].curve.back().errors.paddle_way);
}

TEST(BreakoutStudy, BaselinesPlayAsWellAsTheySee) {
  const auto score = [](PlayerKind kind) {
    BreakoutStudyOptions options;
    options.cases = {{kind, 0, 0.0}};
    options.games = 5;
    return MeanScore(RunBreakout(options, {})[0]);
  };
  const double random = score(PlayerKind::kRandom), follow = score(PlayerKind::kFollow),
               intercept = score(PlayerKind::kIntercept);
  EXPECT_LT(random, 6.0);
  EXPECT_GT(follow, 10.0 * random);
  EXPECT_GT(intercept, 1.5 * follow);
}

TEST(BreakoutStudy, MediansOfScores) {
  std::vector<BreakoutResult> games(3);
  games[0].score = 5;
  games[1].score = 1;
  games[2].score = 9;
  EXPECT_EQ(MedianScore(games), 5.0);
  EXPECT_EQ(MeanScore(games), 5.0);
  games.resize(2);
  EXPECT_EQ(MedianScore(games), 3.0);
}

TEST(BreakoutReplay, HasEveryPictureAndWall) {
  BreakoutGame game({});
  game.Reset(0);
  Replay replay;
  replay.Add(game, nullptr);
  BreakoutGame::State state = game.state();
  state.bricks.reset(0);
  state.in_play = true;
  state.ball_x = 77;
  state.ball_y = 133;
  game.set_state(state);
  replay.Add(game, nullptr);
  const std::string html = replay.Html("a <title>", "<p>below</p>");
  EXPECT_NE(html.find("a &lt;title&gt;"), std::string::npos);
  EXPECT_NE(html.find("[0,0,99,16,0,5,-1,77,133,99,16,0,5,-1,]"), std::string::npos);
  EXPECT_NE(html.find("[1,'0111"), std::string::npos);
  EXPECT_NE(html.find("<p>below</p>"), std::string::npos);
}

}  // namespace
}  // namespace tangible
