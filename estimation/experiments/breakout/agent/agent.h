// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Learns to play Breakout from pictures, rewards and lives alone.
//
// It begins with random buttons; meanwhile and ever after it learns how the paddle answers
// (paddle_model.h) and how the ball leaves what it meets (responses.h). It follows the ball
// (ball_tracker.h), predicts by event stepping where it comes down (flight.h), chooses where the
// paddle should meet it (aim.h) and brings the paddle there (paddle_control.h).

#include <memory>
#include <optional>
#include <random>

#include "tangible/estimation/experiments/breakout/agent/aim.h"
#include "tangible/estimation/experiments/breakout/agent/ball_tracker.h"
#include "tangible/estimation/experiments/breakout/agent/detector.h"
#include "tangible/estimation/experiments/breakout/agent/paddle_control.h"

namespace tangible {

/// What is learned.
struct Knowledge {
  std::optional<PaddleModel> paddle;  ///< none before the first picture
  Responses responses;
};

struct AgentOptions {
  unsigned seed = 0;
  int random_steps = 250;  ///< of kFrameSkip frames, before it plays
  /// Where given, it is used as it is and nothing is learned.
  std::optional<Knowledge> given;
};

class Agent {
 public:
  explicit Agent(AgentOptions options);

  /// A new game begins: what was learned stays.
  void StartGame();
  /// The button for the next kFrameSkip frames, with the picture after those before, the points
  /// won in them and the lives left.
  Button Act(const Picture& picture, double reward, int lives);

  bool plays() const { return steps_ >= options_.random_steps; }
  long steps() const { return steps_; }
  const Knowledge& knowledge() const { return knowledge_; }
  /// Empty, or why it cannot play.
  const std::string& error() const { return error_; }
  const std::optional<Detector>& detector() const { return detector_; }
  /// Where it believes that the ball comes down, for replays.
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
  // Of the game.
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
