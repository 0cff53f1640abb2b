// SPDX-License-Identifier: Apache-2.0
//
// The rules of the game, one by one.

#include "tangible/estimation/experiments/breakout/game/breakout_game.h"

#include <gtest/gtest.h>

#include <vector>

namespace tangible {
namespace {

using State = BreakoutGame::State;

State InPlay() {
  State state;
  state.paddle_x = 72;
  state.in_play = true;
  state.ball_x = 80;
  state.ball_y = 150;
  state.bricks.set();
  return state;
}

State After(const State& before, int frames = 1, Button button = Button::kNone) {
  BreakoutGame game({});
  game.Reset(0);
  game.set_state(before);
  for (int i = 0; i < frames; ++i) game.Frame(button);
  return game.state();
}

TEST(BreakoutGame, ThePaddleGathersSpeedAndStops) {
  State state = InPlay();
  std::vector<int> speeds;
  const auto press = [&](Button button) {
    state = After(state, 1, button);
    speeds.push_back(state.paddle_speed);
  };
  for (int i = 0; i < 6; ++i) press(Button::kRight);
  EXPECT_EQ(speeds, (std::vector<int>{3, 5, 4, 5, 6, 6}));
  speeds.clear();
  for (int i = 0; i < 4; ++i) press(Button::kNone);
  EXPECT_EQ(speeds, (std::vector<int>{3, 2, 1, 0}));
  EXPECT_EQ(state.paddle_x, 72 + 29 + 6);
  // Against the motion it stops, and the press counts as a late one.
  speeds.clear();
  for (int i = 0; i < 5; ++i) press(Button::kRight);
  for (int i = 0; i < 3; ++i) press(Button::kLeft);
  EXPECT_EQ(speeds, (std::vector<int>{3, 5, 4, 5, 6, -1, -3, -2}));
  // Walls.
  EXPECT_EQ(After(state, 100, Button::kRight).paddle_x, 136);
  EXPECT_EQ(After(state, 100, Button::kLeft).paddle_x, 8);
}

TEST(BreakoutGame, ABallHasItsSpeedInEvenAndInOddFrames) {
  for (int speed = 0; speed < breakout::kNumSpeeds; ++speed) {
    State state = InPlay();
    state.speed = speed;
    const State later = After(state, 2);
    const auto& both = breakout::kSpeeds[speed];
    EXPECT_EQ(later.ball_x - state.ball_x, both[0][0] + both[1][0]);
    EXPECT_EQ(later.ball_y - state.ball_y, both[0][1] + both[1][1]);
  }
}

TEST(BreakoutGame, SectionsOfThePaddleTurnTheBall) {
  // Offset of the ball from the paddle, its direction before, and what it has after.
  struct Case {
    int offset, right, after, speed;
  };
  for (const Case& one : {Case{0, 1, -1, 1}, Case{3, 1, -1, 1}, Case{4, 1, -1, 2}, Case{7, 1, 1, 2},
                          Case{7, -1, -1, 2}, Case{10, -1, 1, 2}, Case{13, -1, 1, 1}}) {
    State state = InPlay();
    state.right = one.right;
    state.ball_x = state.paddle_x + one.offset - one.right;
    state.ball_y = 185;
    const State after = After(state);
    EXPECT_EQ(after.right, one.after) << one.offset;
    EXPECT_EQ(after.speed, one.speed) << one.offset;
    EXPECT_EQ(after.down, -1);
    EXPECT_EQ(after.hits, 1);
    // The fastest speed stays.
    state.speed = 4;
    state.ball_x = state.paddle_x + one.offset - 2 * one.right;
    state.ball_y = 183;
    EXPECT_EQ(After(state).speed, 4);
    EXPECT_EQ(After(state).right, one.after);
  }
}

TEST(BreakoutGame, ManyReturnsMakeItFaster) {
  State state = InPlay();
  state.hits = 10;
  state.ball_x = state.paddle_x + 7;
  state.ball_y = 185;
  EXPECT_EQ(After(state).speed, 2);
  state.hits = 11;
  EXPECT_EQ(After(state).speed, 3);
}

TEST(BreakoutGame, BricksTurnYAloneAndOnlyOneUntilAWallOrThePaddle) {
  for (int row = 0; row < breakout::kRows; ++row) {
    State state = InPlay();
    state.bricks.reset();
    for (int i = 0; i < 2 * breakout::kColumns; ++i) {
      state.bricks.set((row * breakout::kColumns + i) % breakout::kBricks);
    }
    state.down = -1;
    state.ball_y = 57 + 6 * (row + 1) + 1;
    if (row + 1 < breakout::kRows) state.ball_y += 6;
    BreakoutGame game({});
    game.Reset(0);
    game.set_state(state);
    const int hit = row + 1 < breakout::kRows ? row + 1 : row;
    EXPECT_EQ(game.Frame(Button::kNone), breakout::kPoints[hit]);
    EXPECT_EQ(game.state().down, 1);
    EXPECT_EQ(game.state().right, 1);
    EXPECT_FALSE(game.state().armed);
    EXPECT_EQ(game.state().speed, hit < breakout::kFastRows ? 4 : 0);
    EXPECT_EQ(game.state().bricks.count(), state.bricks.count() - 1);
    // Through the others without the least effect.
    state = game.state();
    state.down = -1;
    EXPECT_EQ(After(state, 3).bricks, state.bricks);
    // The side walls arm it, but not beside bricks.
    state.ball_x = 150;
    EXPECT_FALSE(After(state).armed);
    state.ball_y = 110;
    EXPECT_TRUE(After(state).armed);
    EXPECT_EQ(After(state).right, -1);
  }
}

TEST(BreakoutGame, TheCeilingNarrowsThePaddleUntilALifeIsLost) {
  State state = InPlay();
  state.bricks.reset();
  state.bricks.set(0);
  state.ball_y = 33;
  state.down = -1;
  state.armed = false;
  State after = After(state);
  EXPECT_TRUE(after.narrow);
  EXPECT_TRUE(after.armed);
  EXPECT_EQ(after.ball_y, 32);
  EXPECT_EQ(after.down, 1);
  after.ball_y = 209;
  BreakoutGame game({});
  game.Reset(0);
  game.set_state(after);
  game.Frame(Button::kNone);
  EXPECT_EQ(game.lives(), 4);
  EXPECT_FALSE(game.state().narrow);
  EXPECT_FALSE(game.state().in_play);
  for (int i = 0; i < 10; ++i) game.Frame(Button::kNone);
  EXPECT_FALSE(game.state().in_play);
  game.Frame(Button::kFire);
  EXPECT_TRUE(game.state().in_play);
  EXPECT_EQ(game.state().ball_y, 122);
}

TEST(BreakoutGame, TheSecondWallComesWithThePaddleAndThereIsNoThird) {
  State state = InPlay();
  state.bricks.reset();
  state.cleared = true;
  state.ball_x = state.paddle_x + 7;
  state.ball_y = 185;
  State after = After(state);
  EXPECT_EQ(after.bricks.count(), 108U);
  EXPECT_EQ(after.walls, 2);
  state.walls = 2;
  EXPECT_EQ(After(state).bricks.count(), 0U);
}

TEST(BreakoutGame, TwoWallsAreWorth864) {
  int points = 0;
  for (int brick = 0; brick < breakout::kBricks; ++brick) {
    points += breakout::kPoints[brick / breakout::kColumns];
  }
  EXPECT_EQ(2 * points, breakout::kMostPoints);
}

TEST(BreakoutGame, IsOverWithoutLives) {
  BreakoutGame game({});
  game.Reset(0);
  while (!game.over()) game.Step(Button::kFire);
  EXPECT_EQ(game.lives(), 0);
  const long frame = game.frame();
  game.Step(Button::kFire);
  EXPECT_EQ(game.frame(), frame);
}

TEST(BreakoutGame, ButtonsStickAtTheirRate) {
  BreakoutGame game({0.25, 7});
  int stuck = 0;
  const int trials = 4000;
  for (int i = 0; i < trials; ++i) {
    game.Reset(0);
    game.Frame(Button::kRight);
    stuck += game.state().paddle_speed == 0 ? 1 : 0;
  }
  // Five standard deviations of a binomial count.
  EXPECT_NEAR(stuck, 0.25 * trials, 5.0 * std::sqrt(trials * 0.25 * 0.75));
}

TEST(BreakoutGame, DrawsWhatThereIs) {
  BreakoutGame game({});
  game.Reset(0);
  State state = InPlay();
  state.bricks.reset(40);
  game.set_state(state);
  Picture picture;
  game.Draw(&picture);
  EXPECT_EQ(picture.pixels.size(), 160U * 210U);
  EXPECT_EQ(picture.At(80, 150), picture.At(72, 189));
  EXPECT_EQ(picture.At(82, 150), 0U);
  EXPECT_EQ(picture.At(87, 192), picture.At(72, 189));
  EXPECT_EQ(picture.At(88, 192), 0U);
  EXPECT_EQ(picture.At(8 + 8 * 4, 57 + 6 * 2), 0U);
  EXPECT_NE(picture.At(8 + 8 * 5, 57 + 6 * 2), 0U);
}

}  // namespace
}  // namespace tangible
