// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/true_knowledge.h"

#include <cmath>

#include "tangible/estimation/experiments/breakout/game/breakout_game.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr double kWrong = 0.1;  // pixels a frame: speeds differ by half a pixel or more
constexpr int kMiddle = 72;     // of the paddle, far from the walls
constexpr int kLearnedSteps = 350;

Vector2<double> SpeedOf(int speed) {
  const auto& both = breakout::kSpeeds[speed];
  return {0.5 * (both[0][0] + both[1][0]), 0.5 * (both[0][1] + both[1][1])};
}

Vector2<double> VelocityOf(const BreakoutGame::State& state) {
  return SpeedOf(state.speed).cwiseProduct(Vector2<double>(state.right, state.down));
}

BreakoutGame::State InPlay(int speed, int right, int down) {
  BreakoutGame::State state;
  state.paddle_x = kMiddle;
  state.in_play = true;
  state.speed = speed;
  state.right = right;
  state.down = down;
  state.bricks.set();
  return state;
}

// Advances a game in that state by one frame.
BreakoutGame::State AfterFrame(const BreakoutGame::State& state) {
  BreakoutGame game({});
  game.Reset(0);
  game.set_state(state);
  game.Frame(Button::kNone);
  return game.state();
}

// Calls visit(before, after, offset) for all returns of both paddles.
template <typename Visit>
void VisitReturns(const Visit& visit) {
  for (int speed = 0; speed < breakout::kNumSpeeds; ++speed) {
    for (const int right : {-1, 1}) {
      for (const bool narrow : {false, true}) {
        const int width = narrow ? breakout::kNarrowPaddleWidth : breakout::kPaddleWidth;
        for (int offset = 0; offset <= width - breakout::kBallWidth; ++offset) {
          BreakoutGame::State state = InPlay(speed, right, 1);
          state.narrow = narrow;
          const int* step = breakout::kSpeeds[speed][1];
          state.ball_x = kMiddle + offset - right * step[0];
          state.ball_y = breakout::kPaddleTop + 1 - breakout::kBallHeight - step[1] + 1;
          visit(VelocityOf(state), VelocityOf(AfterFrame(state)), offset);
        }
      }
    }
  }
}

// Calls visit(before, after, row) for bricks of every row that are met from below.
template <typename Visit>
void VisitBricks(const Visit& visit) {
  for (int speed = 0; speed < breakout::kNumSpeeds; ++speed) {
    for (int row = 0; row < breakout::kRows; ++row) {
      BreakoutGame::State state = InPlay(speed, 1, -1);
      state.bricks.reset();
      for (int i = 0; i < breakout::kColumns; ++i) state.bricks.set(row * breakout::kColumns + i);
      const int bottom = breakout::kBricksTop + (row + 1) * breakout::kBrickHeight;
      state.ball_x = kMiddle;
      state.ball_y = bottom + 1;
      visit(VelocityOf(state), VelocityOf(AfterFrame(state)), row);
    }
  }
}

double TrueWay(int first, int second, int third) {
  BreakoutGame game({});
  game.Reset(0);
  BreakoutGame::State state;
  state.bricks.set();
  for (const int direction : {first, second, third}) {
    state.paddle_x = kMiddle;
    game.set_state(state);
    game.Step(ButtonOf(direction));
    state = game.state();
  }
  return state.paddle_x - kMiddle;
}

// Calls visit(first, second, third) for all sequences of three directions.
template <typename Visit>
void VisitButtons(const Visit& visit) {
  for (int first = -1; first <= 1; ++first) {
    for (int second = -1; second <= 1; ++second) {
      for (int third = -1; third <= 1; ++third) visit(first, second, third);
    }
  }
}

bool Differ(const Vector2<double>& a, const Vector2<double>& b) { return (a - b).norm() > kWrong; }

}  // namespace

Knowledge TrueKnowledge() {
  Knowledge knowledge;
  PaddleModel& paddle =
      knowledge.paddle.emplace(breakout::kLeft, breakout::kRight - breakout::kPaddleWidth);
  // Random buttons until every sequence of three has occurred often; the ball is not served.
  BreakoutGame game({});
  game.Reset(0);
  std::mt19937_64 random = Generator(0, 0);
  PaddleState state;
  state.x = game.state().paddle_x;
  for (int i = 0; i < kLearnedSteps; ++i) {
    const int direction = static_cast<int>(3.0 * Uniform(&random)) - 1;
    game.Step(ButtonOf(direction));
    state = paddle.Learn(state, direction, game.state().paddle_x);
  }
  paddle.Fit();
  Responses& responses = knowledge.responses;
  VisitReturns([&](const Vector2<double>& before, const Vector2<double>& after, int offset) {
    responses.Learn(Meeting::kPaddle, 0, offset, before, after);
  });
  VisitBricks([&](const Vector2<double>& before, const Vector2<double>& after, int row) {
    responses.Learn(Meeting::kBrick, row, 0.0, before, after);
  });
  for (int row = 0; row < breakout::kRows; ++row)
    responses.LearnPoints(row, breakout::kPoints[row]);
  return knowledge;
}

KnowledgeErrors ErrorsOf(const Knowledge& knowledge) {
  KnowledgeErrors errors;
  const PaddleModel paddle = knowledge.paddle.value_or(
      PaddleModel(breakout::kLeft, breakout::kRight - breakout::kPaddleWidth));
  double squares = 0.0;
  int count = 0;
  VisitButtons([&](int first, int second, int third) {
    const double error = paddle.Way(first, second, third) - TrueWay(first, second, third);
    squares += error * error;
    ++count;
  });
  errors.paddle_way = std::sqrt(squares / count);
  int wrong = 0, all = 0;
  const Responses& responses = knowledge.responses;
  VisitReturns([&](const Vector2<double>& before, const Vector2<double>& after, int offset) {
    const Vector2<double> rigid(before.x(), -before.y());
    wrong += Differ(responses.After(Meeting::kPaddle, 0, offset, before, rigid), after) ? 1 : 0;
    ++all;
  });
  errors.returns = static_cast<double>(wrong) / all;
  wrong = all = 0;
  VisitBricks([&](const Vector2<double>& before, const Vector2<double>& after, int row) {
    const Vector2<double> rigid(before.x(), -before.y());
    wrong += Differ(responses.After(Meeting::kBrick, row, 0.0, before, rigid), after) ? 1 : 0;
    ++all;
  });
  errors.bricks = static_cast<double>(wrong) / all;
  int unknown = 0;
  for (int row = 0; row < breakout::kRows; ++row) {
    unknown += responses.Points(row) != breakout::kPoints[row] ? 1 : 0;
  }
  errors.points = static_cast<double>(unknown) / breakout::kRows;
  return errors;
}

}  // namespace tangible
