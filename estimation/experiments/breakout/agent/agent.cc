// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/agent.h"

#include <algorithm>
#include <cmath>

#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kFitEvery = 50;                // steps, while it plays at random and a while after
constexpr int kFitUntil = 2000;              // steps
constexpr int kServeAfter = 2;               // pictures without a ball
constexpr int kMostUseless = 40;             // returns that break nothing, then options are drawn
constexpr double kPredictedFrames = 1000.0;  // of a prediction
constexpr double kReachSpeed = 5.0;  // pixels a frame: of the paddle, whether an option is near
constexpr double kSafeEdge = 2.0;    // pixels

}  // namespace

Agent::Agent(AgentOptions options)
    : options_(std::move(options)), random_(Generator(options_.seed, 1)) {
  if (options_.given) knowledge_ = *options_.given;
}

void Agent::StartGame() { first_ = fresh_ = true; }

bool Agent::Start(const Picture& picture) {
  if (!detector_) {
    detector_.emplace();
    if (!detector_->Start(picture)) {
      error_ = "the first picture: expected walls, rows of bricks and a paddle, got none";
      return false;
    }
    const Arena& arena = detector_->arena();
    const Sight sight = detector_->Look(picture);
    if (!knowledge_.paddle) {
      // The narrow paddle has the same range as the wide one.
      knowledge_.paddle.emplace(arena.left, arena.right - sight.paddle.width);
    }
    flights_ = std::make_unique<FlightModel>(arena, &knowledge_.responses);
    control_ = std::make_unique<PaddleControl>(&*knowledge_.paddle);
  }
  const Sight sight = detector_->Look(picture);
  tracker_.emplace(flights_.get(), &knowledge_.responses);
  paddle_ = PaddleState();
  paddle_.x = sight.paddle.x;
  paddle_width_ = sight.paddle.width;
  knowledge_.paddle->Forget();
  direction_ = 0;
  bricks_ = sight.bricks;
  without_ball_ = useless_returns_ = lives_ = 0;
  flight_.reset();
  aim_.reset();
  return true;
}

PaddlePath Agent::PathOf(const PaddleState& before, int direction, const PaddleState& after) const {
  // The places in each frame by the model, moved so that the last one is where the paddle was seen.
  PaddlePath path;
  path.width = paddle_width_;
  const double end = knowledge_.paddle->After(before, direction).x;
  for (int i = 0; i <= kFrameSkip; ++i) {
    path.x[i] = knowledge_.paddle->After(before, direction, i).x + (after.x - end) * i / kFrameSkip;
  }
  return path;
}

void Agent::Learn(const Sight& sight, double reward) {
  const PaddleState before = paddle_;
  PaddleModel& model = *knowledge_.paddle;
  if (sight.paddle_seen) {
    paddle_ = options_.given ? model.After(before, direction_)
                             : model.Learn(before, direction_, sight.paddle.x);
    paddle_.x = sight.paddle.x;
    paddle_width_ = sight.paddle.width;
  } else {
    paddle_ = model.After(before, direction_);
  }
  const Bricks broken = bricks_ & ~sight.bricks;
  if (!options_.given && broken.count() == 1 && reward > 0.0) {
    for (int i = 0; i < kMostBricks; ++i) {
      if (broken[i]) knowledge_.responses.LearnPoints(flights_->RowOf(i), reward);
    }
  }
  tracker_->See(sight, bricks_, PathOf(before, direction_, paddle_));
  if (tracker_->returned()) ++useless_returns_;
  if (reward > 0.0) useless_returns_ = 0;
  bricks_ = sight.bricks;
  without_ball_ = sight.ball_seen ? 0 : without_ball_ + 1;
  if (!options_.given && steps_ <= kFitUntil && steps_ > 0 &&
      (steps_ % kFitEvery == 0 || steps_ == options_.random_steps)) {
    model.Fit();
  }
}

void Agent::Predict(const Sight& sight) {
  left_ -= kFrameSkip;
  const BallState& ball = tracker_->ball();
  // Below all bricks the flight to the paddle is certain, so that the agent aims.
  const Rectangle& last = detector_->arena().bricks.back();
  const bool below = ball.v.y() > 0.0 && ball.at.y() > last.y + last.height;
  const bool stale = !flight_ || tracker_->surprised() || tracker_->returned() || left_ < 0.0;
  if (!stale && (aim_ || !below)) return;
  flight_ = flights_->Predict(ball, sight.bricks, kPredictedFrames);
  left_ = flight_->frames;
  aim_.reset();
  if (!below || !flight_->arrives) return;
  AimProblem problem;
  problem.arrival = flight_->end;
  problem.frames = flight_->frames;
  problem.bricks = sight.bricks;
  problem.width = paddle_width_;
  problem.paddle_x = paddle_.x;
  problem.speed = kReachSpeed;
  problem.uncertainty = knowledge_.paddle->Uncertainty();
  aim_ = ChooseAim(problem, knowledge_.responses, flights_.get(), &random_,
                   useless_returns_ > kMostUseless);
  if (aim_->random) ++num_random_aims_;
}

int Agent::Choose(const Sight& sight) {
  if (!tracker_->known()) {
    flight_.reset();
    return 0;
  }
  Predict(sight);
  if (!flight_ || !flight_->arrives || left_ < 1.0) return 0;
  const double x = flight_->end.at.x();
  PaddleGoal goal;
  goal.frames = left_;
  if (aim_) {
    goal.x = x - aim_->offset;
    goal.low = x - aim_->option.high;
    goal.high = x - aim_->option.low;
  } else {
    goal.x = x - 0.5 * (paddle_width_ - kBallAcross);
    goal.low = x - (paddle_width_ - kBallAcross - kSafeEdge);
    goal.high = x - kSafeEdge;
  }
  const PaddleModel& model = *knowledge_.paddle;
  goal.x = std::clamp(goal.x, model.low(), model.high());
  return control_->Direction(paddle_, goal);
}

Button Agent::Act(const Picture& picture, double reward, int lives) {
  if (first_) {
    if (!Start(picture)) return Button::kNone;
    first_ = false;
  }
  const Sight sight = detector_->Look(picture);
  if (fresh_) {
    fresh_ = false;
  } else {
    Learn(sight, reward);
  }
  if (lives < lives_) tracker_.emplace(flights_.get(), &knowledge_.responses);
  lives_ = lives;
  Button button = Button::kNone;
  if (!plays()) {
    button = kButtons[static_cast<size_t>(Uniform(&random_) * kButtons.size())];
  } else if (without_ball_ >= kServeAfter || !tracker_->in_play()) {
    button = Button::kFire;
  } else {
    button = ButtonOf(Choose(sight));
  }
  ++steps_;
  direction_ = DirectionOf(button);
  return button;
}

}  // namespace tangible
