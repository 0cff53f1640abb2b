// SPDX-License-Identifier: Apache-2.0
//
// The parts of the agent, without a game: what it finds in pictures, predicts, plans and learns.

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/estimation/experiments/breakout/agent/agent.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr uint32_t kGrey = 0x8e8e8e, kRed = 0xc84848;

// A picture drawn by hand: an arena with two rows of bricks.
Picture Draw(const Bricks& bricks, int paddle_x, int width, int ball_x, int ball_y) {
  Picture picture;
  picture.Fill(0, 17, 160, 193, kGrey);
  picture.Fill(8, 32, 144, 178, 0);
  for (int i = 0; i < 36; ++i) {
    if (bricks[i]) picture.Fill(8 + i % 18 * 8, 57 + i / 18 * 6, 8, 6, i < 18 ? kRed : 0x00ff00);
  }
  picture.Fill(paddle_x, 189, width, 4, kRed);
  if (ball_y > 0) picture.Fill(ball_x, ball_y, 2, 4, kRed);
  return picture;
}

Bricks TwoRows() { return Bricks((1ULL << 36) - 1); }

Arena ArenaOf() {
  Detector detector;
  EXPECT_TRUE(detector.Start(Draw(TwoRows(), 99, 16, 0, 0)));
  return detector.arena();
}

TEST(BreakoutDetector, FindsTheArena) {
  const Arena arena = ArenaOf();
  EXPECT_EQ(arena.left, 8);
  EXPECT_EQ(arena.right, 152);
  EXPECT_EQ(arena.top, 32);
  EXPECT_EQ(arena.paddle_y, 189);
  EXPECT_EQ(arena.paddle_height, 4);
  ASSERT_EQ(arena.bricks.size(), 36U);
  EXPECT_EQ(arena.bricks[19].x, 16);
  EXPECT_EQ(arena.bricks[19].y, 63);
  EXPECT_EQ(arena.bricks[19].width, 8);
  EXPECT_EQ(arena.bricks[19].height, 6);
  Detector blind;
  EXPECT_FALSE(blind.Start(Picture()));
}

TEST(BreakoutDetector, FindsPaddleBallAndBricks) {
  Detector detector;
  ASSERT_TRUE(detector.Start(Draw(TwoRows(), 99, 16, 0, 0)));
  Bricks bricks = TwoRows();
  Sight sight = detector.Look(Draw(bricks, 40, 16, 0, 0));
  EXPECT_FALSE(sight.ball_seen);
  EXPECT_EQ(sight.paddle.x, 40);
  bricks.reset(20);
  // In the gap of a brick, before another brick, and beside bricks.
  for (const auto& [x, y] : {std::pair{26, 64}, std::pair{60, 66}, std::pair{100, 120}}) {
    sight = detector.Look(Draw(bricks, 40, 12, x, y));
    ASSERT_TRUE(sight.ball_seen) << x;
    EXPECT_EQ(sight.ball.x, x);
    EXPECT_EQ(sight.ball.y, y);
    EXPECT_EQ(sight.paddle.width, 12);
    EXPECT_EQ(sight.bricks, bricks);
  }
  // Before bricks of its own colour it is not seen.
  EXPECT_FALSE(detector.Look(Draw(bricks, 40, 12, 60, 58)).ball_seen);
  // Where it overlaps the paddle.
  sight = detector.Look(Draw(bricks, 40, 12, 45, 187));
  ASSERT_TRUE(sight.ball_seen);
  EXPECT_EQ(sight.ball.y, 187);
  EXPECT_EQ(sight.paddle.x, 40);
  EXPECT_EQ(sight.paddle.width, 12);
}

TEST(BreakoutFlight, MeetsWallsCeilingAndThePaddlesLine) {
  const Responses responses;
  FlightModel flights(ArenaOf(), &responses);
  BallState ball;
  ball.at = {140.0, 170.0};
  ball.v = {2.0, -3.0};
  // Without bricks: the right wall after 5 frames, the ceiling after 46, down again.
  const Flight flight = flights.Predict(ball, Bricks(), 1000.0);
  ASSERT_TRUE(flight.arrives);
  ASSERT_EQ(flight.meetings.size(), 3U);
  EXPECT_EQ(flight.meetings[0].meeting, Meeting::kSide);
  EXPECT_EQ(flight.meetings[0].frames, 5.0);
  EXPECT_EQ(flight.meetings[1].meeting, Meeting::kCeiling);
  EXPECT_EQ(flight.meetings[1].frames, 46.0);
  EXPECT_EQ(flight.meetings[2].meeting, Meeting::kSide);
  EXPECT_EQ(flight.meetings[2].frames, 76.0);
  // From 32 down by 3 a frame, the lower edge is below 189 first at 188.
  EXPECT_EQ(flight.frames, 46.0 + 52.0);
  EXPECT_EQ(flight.end.at.y(), 188.0);
  EXPECT_EQ(flight.end.at.x(), 8.0 + 2.0 * 22.0);
  EXPECT_EQ(flight.end.v, Vector2<double>(2.0, 3.0));
}

TEST(BreakoutFlight, ABrickTurnsYAloneAndIsGone) {
  const Responses responses;
  FlightModel flights(ArenaOf(), &responses);
  BallState ball;
  ball.at = {80.0, 150.0};
  ball.v = {1.0, -2.0};
  const Flight flight = flights.Predict(ball, TwoRows(), 1000.0);
  ASSERT_TRUE(flight.arrives);
  ASSERT_GE(flight.meetings.size(), 1U);
  EXPECT_EQ(flight.meetings[0].meeting, Meeting::kBrick);
  // The lower edge of the second row is at 69: met at y <= 69, after 41 frames at 68.
  EXPECT_EQ(flight.meetings[0].frames, 41.0);
  EXPECT_EQ(flight.meetings[0].brick, 18 + (80 + 41 - 8) / 8);
  EXPECT_EQ(flight.meetings[0].after.v, Vector2<double>(1.0, 2.0));
  EXPECT_EQ(flight.bricks.count(), 35U);
  // From the side the rigid ball would turn x.
  Bricks one;
  one.set(18 + 9);
  ball.at = {70.0, 64.0};
  ball.v = {2.0, -0.5};
  const Flight beside = flights.Predict(ball, one, 20.0);
  ASSERT_EQ(beside.meetings.size(), 1U);
  EXPECT_EQ(beside.meetings[0].after.v, Vector2<double>(2.0, 0.5));
}

TEST(BreakoutFlight, BrokenBricksDoNotCountUntilItIsArmed) {
  const Responses responses;
  FlightModel flights(ArenaOf(), &responses);
  BallState ball;
  ball.at = {80.0, 100.0};
  ball.v = {1.0, -2.0};
  ball.armed = false;
  const Flight flight = flights.Predict(ball, TwoRows(), 1000.0);
  ASSERT_GE(flight.meetings.size(), 2U);
  EXPECT_EQ(flight.meetings[0].meeting, Meeting::kCeiling);
  EXPECT_EQ(flight.meetings[1].meeting, Meeting::kBrick);
  EXPECT_LT(flight.meetings[1].brick, 18);
}

// A paddle by the law, with numbers that are not the guess.
PaddleModel Lawful() {
  PaddleModel model(8.0, 136.0);
  model.set_numbers({2.5, 0.4, 0.5, 0.3});
  return model;
}

TEST(BreakoutPaddle, FindsTheNumbersOfALawfulPaddle) {
  const PaddleModel truth = Lawful();
  PaddleModel learned(8.0, 136.0);
  std::mt19937_64 random = Generator(3, 0);
  PaddleState real, seen;
  real.x = seen.x = 70.0;
  for (int i = 0; i < 200; ++i) {
    const int direction = static_cast<int>(3.0 * Uniform(&random)) - 1;
    real = truth.After(real, direction);
    seen = learned.Learn(seen, direction, real.x);
  }
  ASSERT_TRUE(learned.Fit());
  const auto numbers = NumbersOf(learned.numbers()), expected = NumbersOf(truth.numbers());
  // The prior, three times as wide as the guess, pulls by 1/100 of a pixel's error.
  for (int i = 0; i < kNumPaddleNumbers; ++i) EXPECT_NEAR(numbers[i], expected[i], 0.02) << i;
  EXPECT_FALSE(PaddleModel(8.0, 136.0).Fit());
}

TEST(BreakoutPaddle, LearnsWhatTheLawLeavesAndHowSureItIs) {
  PaddleModel model(8.0, 136.0);
  PaddleState state;
  state.x = 70.0;
  const double unknown = model.Variance(state, 1);
  // To the right and to the left alike: 11 and 13 pixels in turn.
  for (int i = 0; i < 12; ++i) {
    state.last = state.before = 0;
    state.v = 0.0;
    state.x = 70.0;
    state = model.Learn(state, i % 2 == 0 ? 1 : -1,
                        70.0 + (i % 2 == 0 ? 1 : -1) * (i % 4 < 2 ? 11 : 13));
  }
  state = PaddleState();
  state.x = 70.0;
  EXPECT_NEAR(model.After(state, 1).x, 82.0, 0.5);
  EXPECT_NEAR(model.After(state, -1).x, 58.0, 0.5);
  EXPECT_LT(model.Variance(state, 1), 2.0);
  EXPECT_GT(model.Variance(state, 1), 0.5);
  EXPECT_GT(unknown, 10.0);
  // From a wall it is another situation.
  state.x = 8.0;
  EXPECT_EQ(model.Variance(state, 1), unknown);
}

TEST(BreakoutPaddle, TheStepHasExactJacobians) {
  const PaddleModel model = Lawful();
  PaddleStep step(model);
  std::string error;
  VectorX<double> next, up, down;
  MatrixX<double> a, b;
  // Pressed on, pressed against the motion, released in part.
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(60.0, 3.0, 0.7), Eigen::Vector3d(60.0, 3.0, -0.7),
        Eigen::Vector3d(60.0, -3.0, -0.2)}) {
    const VectorX<double> x = at.head(2), u = at.tail(1);
    ASSERT_TRUE(step.Linearise(0, x, u, &next, &a, &b, &error));
    ASSERT_TRUE(step.Step(0, x, u, &up, &error));
    EXPECT_EQ(up, next);
    EXPECT_GT(b.norm(), 1.0);
    for (const double h : {1e-4, 1e-5}) {
      for (int i = 0; i < 3; ++i) {
        VectorX<double> high = at, low = at;
        high[i] += h;
        low[i] -= h;
        ASSERT_TRUE(step.Step(0, high.head(2), high.tail(1), &up, &error));
        ASSERT_TRUE(step.Step(0, low.head(2), low.tail(1), &down, &error));
        const VectorX<double> column =
            i < 2 ? VectorX<double>(a.col(i)) : VectorX<double>(b.col(0));
        // Truncation h² and rounding ε |x| / h.
        EXPECT_LT(((up - down) / (2.0 * h) - column).norm(), 10.0 * h * h + 1e-13 / h) << i;
      }
    }
  }
}

TEST(BreakoutPaddle, TheControlBringsItToItsGoal) {
  const PaddleModel model = Lawful();
  PaddleControl control(&model);
  for (const double goal_x : {12.0, 57.0, 90.0, 131.0}) {
    PaddleState state;
    state.x = 70.0;
    PaddleGoal goal{goal_x, goal_x - 3.0, goal_x + 3.0, 60.0};
    for (; goal.frames > 0.0; goal.frames -= kFrameSkip) {
      state = model.After(state, control.Direction(state, goal));
    }
    EXPECT_NEAR(state.x, goal_x, 3.0);
  }
  EXPECT_GT(control.num_plans(), 0);
}

TEST(BreakoutResponses, AreRigidFirstAndThenAsSeen) {
  Responses responses;
  const Vector2<double> before(1.0, 2.0), rigid(1.0, -2.0), seen(-2.0, -1.0);
  EXPECT_EQ(responses.After(Meeting::kPaddle, 0, 3.0, before, rigid), rigid);
  responses.Learn(Meeting::kPaddle, 0, 3.0, before, seen);
  EXPECT_EQ(responses.After(Meeting::kPaddle, 0, 3.0, before, rigid), seen);
  EXPECT_EQ(responses.After(Meeting::kPaddle, 0, 4.0, before, rigid), seen);
  // Far away the speed is that of other returns, the direction rigid.
  EXPECT_EQ(responses.After(Meeting::kPaddle, 0, 12.0, before, rigid), Vector2<double>(2.0, -1.0));
  // A brick's speed holds for its row, at speeds not seen there too.
  responses.Learn(Meeting::kBrick, 2, 0.0, {1.0, -1.0}, {2.0, 3.0});
  EXPECT_EQ(responses.After(Meeting::kBrick, 2, 0.0, {-1.0, -1.5}, {1.0, -1.5}),
            Vector2<double>(-2.0, 3.0));
  EXPECT_EQ(responses.After(Meeting::kBrick, 1, 0.0, {-1.0, -1.5}, {1.0, -1.5}),
            Vector2<double>(-1.0, 1.5));
}

// Returns to the left of the paddle's middle go left, others right.
Responses TwoWays() {
  Responses responses;
  for (int offset = 0; offset <= 14; ++offset) {
    for (const double x : {-2.0, 2.0}) {
      responses.Learn(Meeting::kPaddle, 0, offset, {x, 3.0}, {offset < 8 ? -2.0 : 2.0, -3.0});
    }
  }
  return responses;
}

TEST(BreakoutAim, FindsTheOnlyBrick) {
  const Responses responses = TwoWays();
  FlightModel flights(ArenaOf(), &responses);
  const std::vector<AimOption> options = AimOptions(responses, {2.0, 3.0}, 16.0);
  ASSERT_EQ(options.size(), 2U);
  EXPECT_EQ(options[0].low, 0.0);
  EXPECT_EQ(options[0].high, 7.0);
  EXPECT_EQ(options[1].high, 14.0);
  std::mt19937_64 random = Generator(1, 0);
  AimProblem problem;
  problem.arrival.v = {2.0, 3.0};
  problem.arrival.at = {80.0, 188.0};
  problem.frames = 40.0;
  problem.width = 16.0;
  problem.paddle_x = 72.0;
  problem.speed = 5.0;
  // To the right it would come to (80 + 2 · 40) reflected at 150: brick 18 + 16.
  for (const bool right : {false, true}) {
    const double x = right ? 300.0 - (80.0 + 2.0 * 40.0) : 16.0 - (80.0 - 2.0 * 40.0);
    problem.bricks.reset();
    problem.bricks.set(18 + static_cast<int>((x - 8.0) / 8.0));
    const Aim aim = ChooseAim(problem, responses, &flights, &random, false);
    EXPECT_FALSE(aim.random);
    EXPECT_EQ(aim.option.after.x() > 0.0, right);
    // Within the interval and off its ends.
    EXPECT_GE(aim.offset, aim.option.low + 1.0);
    EXPECT_LE(aim.offset, aim.option.high - 1.0);
  }
  // The less is known of where the paddle will be, the nearer to its middle.
  problem.uncertainty = 6.0;
  const Aim unsure = ChooseAim(problem, responses, &flights, &random, false);
  EXPECT_NEAR(unsure.offset, 7.0, 1.5);
  problem.uncertainty = 0.0;
  // A brick that takes several returns is found too; without bricks there is nothing to find.
  problem.bricks.reset();
  problem.bricks.set(18 + 9);
  const Aim later = ChooseAim(problem, responses, &flights, &random, false);
  EXPECT_FALSE(later.random);
  EXPECT_GT(later.flights, 2);
  problem.bricks.reset();
  EXPECT_TRUE(ChooseAim(problem, responses, &flights, &random, false).random);
}

TEST(BreakoutAgent, SaysThatItSeesNoArena) {
  Agent agent{AgentOptions()};
  agent.StartGame();
  EXPECT_EQ(agent.Act(Picture(), 0.0, 5), Button::kNone);
  EXPECT_NE(agent.error().find("expected walls"), std::string::npos);
}

}  // namespace
}  // namespace tangible
