// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The agent that learns to play Breakout from pictures, rewards and lives.
//
// It begins with random buttons. Then and during the whole game it learns how the paddle responds
// to buttons (paddle_model.h) and with which velocity the ball leaves a contact (responses.h). It
// follows the ball (ball_tracker.h), predicts by event stepping where the ball comes down
// (flight.h), chooses where the paddle should meet it (aim.h) and moves the paddle there
// (paddle_control.h).

#include <memory>
#include <optional>
#include <random>

#include "tangible/estimation/experiments/breakout/agent/aim.h"
#include "tangible/estimation/experiments/breakout/agent/ball_tracker.h"
#include "tangible/estimation/experiments/breakout/agent/detector.h"
#include "tangible/estimation/experiments/breakout/agent/paddle_control.h"

namespace tangible {

/// The knowledge that is learned.
struct Knowledge {
  std::optional<PaddleModel> paddle;  ///< none before the first picture
  Responses responses;
};

struct AgentOptions {
  unsigned seed = 0;
  int random_steps = 250;  ///< of kFrameSkip frames, before it plays
  /// If given, this knowledge is used and nothing is learned.
  std::optional<Knowledge> given;
};

class Agent {
 public:
  explicit Agent(AgentOptions options);

  /// Begins a new game and keeps what was learned.
  void StartGame();
  /// The button for the next kFrameSkip frames, with the picture after those before, the points
  /// won in them and the lives left.
  Button Act(const Picture& picture, double reward, int lives);

  bool plays() const { return steps_ >= options_.random_steps; }
  long steps() const { return steps_; }
  const Knowledge& knowledge() const { return knowledge_; }
  /// An error that prevents play, or empty.
  const std::string& error() const { return error_; }
  const std::optional<Detector>& detector() const { return detector_; }
  /// The predicted place where the ball comes down, for replays.
  const std::optional<Flight>& prediction() const { return flight_; }
  long num_event_steps() const { return flights_ == nullptr ? 0 : flights_->num_steps(); }
  long num_plans() const { return control_ == nullptr ? 0 : control_->num_plans(); }
  long num_random_aims() const { return num_random_aims_; }

 private:
  bool Start(const Picture& picture);
  void Learn(const Sight& sight, double reward);
  int Choose(const Sight& sight);
  void Predict(const Sight& sight);
  PaddlePath PathOf(const PaddleState& before, int direction, const PaddleState& after) const;

  AgentOptions options_;
  std::mt19937_64 random_;
  std::optional<Detector> detector_;
  Knowledge knowledge_;
  std::unique_ptr<FlightModel> flights_;
  std::unique_ptr<PaddleControl> control_;
  std::optional<BallTracker> tracker_;
  std::string error_;
  long steps_ = 0, num_random_aims_ = 0;
  // The state of the current game.
  bool first_ = true;  ///< no picture of it was seen
  bool fresh_ = true;  ///< no button of it was pressed
  int lives_ = 0;
  PaddleState paddle_;
  double paddle_width_ = 0.0;
  int direction_ = 0;  ///< of the last step
  Bricks bricks_;
  int without_ball_ = 0;  ///< pictures
  int useless_returns_ = 0;
  std::optional<Flight> flight_;  ///< until the ball comes down
  std::optional<Aim> aim_;
  double left_ = 0.0;  ///< frames until then
};

}  // namespace tangible
