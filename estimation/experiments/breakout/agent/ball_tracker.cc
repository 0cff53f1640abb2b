// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/ball_tracker.h"

#include <cmath>

#include "tangible/estimation/experiments/breakout/agent/tolerances.h"

namespace tangible {
namespace {

constexpr double kFastest = 6.0;  // pixels a frame: no ball is faster

}  // namespace

// The ball four frames later; its contacts are listed in met_.
BallState BallTracker::Advance(const Bricks& bricks, const PaddlePath& paddle) {
  BallState ball = ball_;
  double frames = 0.0;
  // There is at most one return, and no contact below the rows of the paddle.
  for (int part = 0; part < 2; ++part) {
    const Flight flight = flights_->Predict(ball, bricks, kFrameSkip - frames);
    for (const FlightMeeting& one : flight.meetings) {
      met_.push_back({one.meeting, one.brick < 0 ? 0 : flights_->RowOf(one.brick), 0.0});
    }
    ball = flight.end;
    frames += flight.frames;
    if (!flight.arrives) return ball;
    const double offset = ball.at.x() - paddle.x[static_cast<size_t>(std::lround(frames))];
    if (offset >= -kBallAcross && offset <= paddle.width) {
      met_.push_back({Meeting::kPaddle, 0, offset});
      ball.v = responses_->After(Meeting::kPaddle, 0, offset, ball.v, {ball.v.x(), -ball.v.y()});
      ball.armed = returned_ = true;
    }
    if (frames >= kFrameSkip) return ball;
    if (ball.v.y() > 0.0) {
      ball.at += (kFrameSkip - frames) * ball.v;
      return ball;
    }
  }
  return ball;
}

void BallTracker::LearnFrom(const Vector2<double>& after) {
  if (met_.size() == 1 && before_.squaredNorm() > 0.0) {
    const Met& met = met_.front();
    const bool turned = met.meeting == Meeting::kSide ? before_.x() * after.x() < 0.0
                                                      : before_.y() * after.y() < 0.0;
    if (turned) responses_->Learn(met.meeting, met.row, met.offset, before_, after);
  }
  met_.clear();
  before_ = after;
}

void BallTracker::See(const Sight& sight, const Bricks& bricks_before, const PaddlePath& paddle) {
  surprised_ = returned_ = false;
  if (!sight.ball_seen) {
    ++unseen_;
    if (!in_play()) {
      seen_ = known_ = believed_ = false;
      met_.clear();
      before_.setZero();
    } else if (known_) {
      ball_ = Advance(bricks_before, paddle);
    }
    return;
  }
  const Vector2<double> at(sight.ball.x, sight.ball.y);
  const bool was_hidden = unseen_ > 0;
  unseen_ = 0;
  if (!seen_) {
    ball_ = BallState();
    ball_.at = at;
    seen_ = true;
    return;
  }
  const Vector2<double> v = (at - ball_.at) / kFrameSkip;
  const size_t met_before = met_.size();
  const BallState predicted = known_ ? Advance(bricks_before, paddle) : ball_;
  const bool agrees = known_ && (predicted.at - at).cwiseAbs().maxCoeff() <= kAsPredicted;
  if (agrees) {
    ball_.v = predicted.v;
    ball_.armed = predicted.armed;
    if (met_.size() == met_before && !was_hidden) {
      // The velocity is accepted: over a whole step without a contact the difference is exact.
      ball_.v = v;
      believed_ = true;
      LearnFrom(v);
    }
  } else {
    surprised_ = true;
    // A velocity that was not accepted does not predict contacts.
    if (!believed_) met_.resize(met_before);
    believed_ = false;
    const Bricks broken = bricks_before & ~sight.bricks;
    for (int i = 0; i < kMostBricks && broken.any(); ++i) {
      if (!broken[i]) continue;
      if (met_.size() == met_before) met_.push_back({Meeting::kBrick, flights_->RowOf(i), 0.0});
      break;
    }
    ball_.v = v.cwiseAbs().maxCoeff() <= kFastest ? v : predicted.v;
    ball_.armed = broken.any() ? false : predicted.armed;
    known_ = true;
  }
  if ((bricks_before & ~sight.bricks).any() && ball_.v.y() > 0.0) ball_.armed = false;
  ball_.at = at;
}

}  // namespace tangible
