// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/flight.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/experiments/breakout/agent/tolerances.h"
#include "tangible/scene/scene.h"

namespace tangible {
namespace {

// Bodies: the ball, walls, the paddle's line, bricks.
constexpr int kBall = 0, kLeftWall = 1, kRightWall = 2, kCeiling = 3, kLine = 4, kFirstBrick = 5;
constexpr int kMostPlaced = 8;          // bricks in the scene: a row is met in at most three
constexpr double kAway = -1000.0;       // m: where bricks are that do not count
constexpr double kFarFrames = 10000.0;  // longer than any flight from wall to wall
constexpr int kMostMeetings = 60;       // of a flight

BasicBody<double> StaticBody(const char* name, BasicShape<double> shape) {
  BasicBody<double> body;
  body.name = name;
  body.motion = Motion::kStatic;
  body.shape = std::move(shape);
  body.restitution = 1.0;
  return body;
}

BasicBody<double> Wall(const char* name, double x, double y, double offset) {
  return StaticBody(name, {ShapeType::kHalfPlane, {x, y, offset}});
}

Scene SceneOf(const Arena& arena) {
  Scene scene;
  scene.name = "breakout";
  scene.gravity.setZero();
  BasicBody<double> ball;
  ball.name = "ball";
  ball.shape = {ShapeType::kBox, {double{kBallAcross}, double{kBallDown}}};
  ball.mass = 1.0;
  ball.restitution = 1.0;
  scene.bodies = {ball, Wall("left", 1.0, 0.0, arena.left), Wall("right", -1.0, 0.0, -arena.right),
                  Wall("ceiling", 0.0, -1.0, arena.top - kPictureHeight),
                  Wall("line", 0.0, 1.0, kPictureHeight - arena.paddle_y)};
  const Rectangle& size = arena.bricks.front();
  for (int i = 0; i < kMostPlaced; ++i) {
    BasicBody<double> brick = StaticBody(
        "", {ShapeType::kBox, {static_cast<double>(size.width), static_cast<double>(size.height)}});
    brick.name = "brick" + std::to_string(i);
    brick.position = {0.0, kAway};
    scene.bodies.push_back(brick);
  }
  // The ball does not rotate.
  BasicJoint<double> upright;
  upright.name = "upright";
  upright.type = JointType::kFixedAngle;
  upright.bodies[0] = kBall;
  scene.joints = {upright};
  scene.simulation.stepping = Stepping::kEvent;
  // Without forces the ball flies straight and does not rotate, so that any integrator is exact.
  scene.simulation.integrator = Integrator::kTrapezoidal;
  scene.simulation.joint_correction = JointCorrection::kNone;
  scene.simulation.dt = kFarFrames;
  scene.simulation.duration = kFarFrames;
  return scene;
}

}  // namespace

FlightModel::FlightModel(const Arena& arena, const Responses* responses)
    : arena_(arena), responses_(responses) {
  BuildModel(SceneOf(arena), &model_, &home_);
  // The bricks wait in one place, where they would hide each other; a flight sets their poses.
  model_.seams = nullptr;
  state_ = home_;
  stepper_ = std::make_unique<Stepper>(model_);
}

void FlightModel::PlaceBricks(const BallState& ball, const Bricks& bricks, double frames) {
  placed_.clear();
  const int rows = static_cast<int>(arena_.bricks.size()) / kBrickColumns;
  for (int i = 0; i < rows; ++i) {
    // The rows in the order in which the ball reaches them.
    const int row = ball.v.y() < 0.0 ? rows - 1 - i : i;
    const Rectangle& first = arena_.bricks[static_cast<size_t>(row) * kBrickColumns];
    // The times at which the ball overlaps the row, and its horizontal path meanwhile.
    double from = (first.y - kBallDown - ball.at.y()) / ball.v.y();
    double to = (first.y + first.height - ball.at.y()) / ball.v.y();
    if (from > to) std::swap(from, to);
    from = std::max(from, 0.0);
    to = std::min(to, frames);
    if (from > to) continue;
    const double enters = ball.at.x() + from * ball.v.x(), leaves = ball.at.x() + to * ball.v.x();
    const double left = std::min(enters, leaves), right = std::max(enters, leaves);
    for (int column = 0; column < kBrickColumns; ++column) {
      const int brick = row * kBrickColumns + column;
      const Rectangle& place = arena_.bricks[brick];
      if (!bricks[brick] || place.x > right + kBallAcross + kBesideWay ||
          place.x + place.width < left - kBesideWay) {
        continue;
      }
      double* pose = &state_.pose[3 * (kFirstBrick + placed_.size())];
      pose[0] = place.x + 0.5 * place.width;
      pose[1] = kPictureHeight - place.y - 0.5 * place.height;
      placed_.push_back(brick);
      if (static_cast<int>(placed_.size()) == kMostPlaced) return;
    }
  }
}

void FlightModel::Place(const BallState& ball, const Bricks& bricks, double frames) {
  state_.pose = home_.pose;
  state_.pose[0] = ball.at.x() + 0.5 * kBallAcross;
  state_.pose[1] = kPictureHeight - ball.at.y() - 0.5 * kBallDown;
  state_.twist[0] = ball.v.x();
  state_.twist[1] = -ball.v.y();
  state_.twist[2] = 0.0;
  // The ball leaves the paddle from within its rows.
  if (ball.v.y() <= 0.0) state_.pose[3 * kLine + 1] = kAway;
  if (ball.armed && ball.v.y() != 0.0) PlaceBricks(ball, bricks, frames);
}

bool FlightModel::FirstMeeting(const BallState& ball, const Bricks& bricks, double frames,
                               int* body, double* when, Vector2<double>* rigid) {
  // The step ends a little after the ball would reach a wall.
  const double across = ball.v.x() > 0.0   ? (arena_.right - kBallAcross - ball.at.x()) / ball.v.x()
                        : ball.v.x() < 0.0 ? (arena_.left - ball.at.x()) / ball.v.x()
                                           : kFarFrames;
  const double down = ball.v.y() > 0.0   ? (arena_.paddle_y - kBallDown - ball.at.y()) / ball.v.y()
                      : ball.v.y() < 0.0 ? (arena_.top - ball.at.y()) / ball.v.y()
                                         : kFarFrames;
  const double length =
      std::min(frames, std::max(0.0, std::min(across, down > -1.0 ? down : kFarFrames))) +
      kPassedWall;
  Place(ball, bricks, length);
  stepper_->ClearGuess();
  ++num_steps_;
  const StepReport report = stepper_->Step(model_, 0.0, length, &state_);
  if (report.status != StepStatus::kDone) return false;
  // One body moves, so that there is one island.
  const EventRecord& record = stepper_->parts().islands[0]->events;
  *when = 0.0;
  for (int i = 0; i < record.num_parts; ++i) {
    const EventPart& part = *record.parts[i];
    if (!part.is_impulses) {
      *when = part.segment.time + part.segment.length;
      continue;
    }
    if (part.impulses.contacts.empty()) continue;
    const ActiveContact& contact = part.impulses.contacts.front();
    *body = contact.a == kBall ? contact.b : contact.a;
    if (*body >= kFirstBrick) *body = kFirstBrick + placed_[*body - kFirstBrick];
    *rigid = {part.impulses.new_twist[0], -part.impulses.new_twist[1]};
    return *when <= frames;
  }
  return false;
}

void FlightModel::Turn(int body, const Vector2<double>& rigid, Flight* flight) {
  FlightMeeting meeting;
  meeting.before = flight->end;
  meeting.frames = flight->frames;
  BallState& ball = flight->end;
  meeting.meeting = body == kCeiling      ? Meeting::kCeiling
                    : body >= kFirstBrick ? Meeting::kBrick
                                          : Meeting::kSide;
  const int row = body >= kFirstBrick ? RowOf(body - kFirstBrick) : 0;
  ball.v = responses_->After(meeting.meeting, row, 0.0, ball.v, rigid);
  if (meeting.meeting == Meeting::kBrick) {
    meeting.brick = body - kFirstBrick;
    flight->bricks[meeting.brick] = false;
    ball.armed = false;
  } else if (meeting.meeting == Meeting::kCeiling) {
    ball.at.y() = arena_.top;
    ball.armed = true;
  } else {
    ball.at.x() = body == kLeftWall ? arena_.left : arena_.right - kBallAcross;
    // Contacts with walls beside bricks do not count.
    const Rectangle &first = arena_.bricks.front(), &last = arena_.bricks.back();
    const bool beside = ball.at.y() >= first.y && ball.at.y() <= last.y + last.height;
    ball.armed = ball.armed || !beside;
  }
  meeting.after = ball;
  flight->meetings.push_back(meeting);
}

Flight FlightModel::Predict(const BallState& ball, const Bricks& bricks, double frames) {
  Flight flight;
  flight.end = ball;
  flight.bricks = bricks;
  while (flight.frames < frames) {
    BallState& end = flight.end;
    const double left = frames - flight.frames;
    int body = -1;
    double when = 0.0;
    Vector2<double> rigid;
    const bool below = end.at.y() + kBallDown > arena_.paddle_y && end.v.y() > 0.0;
    const bool meets = !below && static_cast<int>(flight.meetings.size()) < kMostMeetings &&
                       FirstMeeting(end, flight.bricks, left, &body, &when, &rigid);
    // The paddle reflects a ball that overlaps it, all other bodies a ball that touches them.
    const double frame = !meets          ? left
                         : body == kLine ? std::floor(when + kSameFrame) + 1.0
                                         : std::ceil(when - kSameFrame);
    if (frame > left) {
      end.at += left * end.v;
      flight.frames = frames;
      break;
    }
    end.at += frame * end.v;
    flight.frames += frame;
    if (!meets) break;
    if (body == kLine) {
      // The ball may meet a side wall in the same frame.
      end.at.x() = std::clamp(end.at.x(), static_cast<double>(arena_.left),
                              static_cast<double>(arena_.right - kBallAcross));
      flight.arrives = true;
      break;
    }
    Turn(body, rigid, &flight);
  }
  return flight;
}

}  // namespace tangible
