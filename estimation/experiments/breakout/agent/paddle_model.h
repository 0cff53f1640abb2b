// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How the paddle answers buttons: a body that is pushed against drag, learned from what is seen.
//
// In each frame, with u = −1, 0 or 1 for left, none, right (pixels, frames):
//
//   w  = β v where u v < 0, else v           a press against the motion keeps the share β
//   v⁺ = (1 − d₀ − (d₁ − d₀) |u|) w + a u    drag d₀ of a free paddle and d₁ of a pressed one
//   x⁺ = x + v⁺, stopped by the walls
//
// The four numbers minimise the squared errors of the ways that were seen over four frames each
// (estimation/fit). What the law leaves is a mean and a variance for each situation, learned beside
// it: the last three buttons, the wall at which the step begins, and whether the step before began
// at one, where left and right are alike. The game counts presses in whole pixels, which no law of
// this form does; and buttons that stick make the answer random.

#include <array>
#include <vector>

#include "tangible/control/step_map.h"
#include "tangible/estimation/experiments/breakout/picture/picture.h"

namespace tangible {

struct PaddleNumbers {
  double gain = 1.0;       ///< a, pixels/frame²
  double drag = 0.2;       ///< d₁, 1/frame
  double free_drag = 0.2;  ///< d₀, 1/frame
  double keep = 1.0;       ///< β
};
inline constexpr int kNumPaddleNumbers = 4;
inline constexpr const char* kPaddleNumberNames[] = {"gain", "drag", "free drag", "keep"};
std::array<double, kNumPaddleNumbers> NumbersOf(const PaddleNumbers& numbers);

/// −1 left, 1 right, 0 others.
int DirectionOf(Button button);
Button ButtonOf(int direction);

struct PaddleState {
  double x = 0.0;            ///< of the left edge, pixels
  double v = 0.0;            ///< pixels a frame
  int last = 0, before = 0;  ///< directions of the last two steps
  bool from_wall = false;    ///< the last step began at a wall
};

class PaddleModel {
 public:
  /// Of what is between low and high, the range of x.
  PaddleModel(double low, double high) : low_(low), high_(high) {}

  double low() const { return low_; }
  double high() const { return high_; }
  const PaddleNumbers& numbers() const { return numbers_; }
  void set_numbers(const PaddleNumbers& numbers) { numbers_ = numbers; }

  /// After `frames` ≤ kFrameSkip of a step in that direction.
  PaddleState After(const PaddleState& state, int direction, int frames) const;
  PaddleState After(const PaddleState& state, int direction) const {
    return After(state, direction, kFrameSkip);
  }
  /// Of the place after a step in that direction, pixels².
  double Variance(const PaddleState& state, int direction) const;
  /// A step was seen to end at x: returns the state there, and keeps the step to learn from.
  PaddleState Learn(const PaddleState& before, int direction, double x);
  /// The way of three steps' last, from rest far from the walls, pixels: what is compared with the
  /// truth.
  double Way(int first, int second, int third) const;
  /// Adopts the numbers that fit the steps seen so far; false where there are too few.
  bool Fit();
  /// Root mean square of what the law and the means leave of the last steps that end away from
  /// walls, pixels.
  double Uncertainty() const;
  int num_steps() const { return static_cast<int>(steps_.size()); }

  /// Where the paddle is by itself: nothing before it is known.
  void Forget() { sequence_begins_ = true; }

 private:
  struct Seen {
    PaddleState before;
    double to = 0.0;
    int direction = 0;
    bool begins = false;  ///< the paddle rests before it
  };
  friend class PaddleWays;
  static constexpr int kSequences = 27, kSituations = 6 * kSequences;
  struct Situation {
    int number = 0;
    int beside = 0;     ///< the same far from walls
    double sign = 1.0;  ///< −1: left and right are exchanged
  };
  /// What was left by the law in a situation.
  struct Rest {
    double mean = 0.0, variance = 0.0;
    int count = 0;
    void Add(double error);
  };
  Situation SituationOf(const PaddleState& state, int direction) const;
  const Rest& RestOf(const Situation& situation) const;
  bool AtWall(double x) const { return x <= low_ || x >= high_; }
  void Average();

  double low_, high_;
  PaddleNumbers numbers_;
  std::vector<Seen> steps_;
  bool sequence_begins_ = true;
  std::array<Rest, kSituations> rests_{};
  double rest_ = 0.0;  ///< mean square of what is left of all
};

/// The law, without the means, as a step to plan over: states x, v; the control u in [−1, 1].
class PaddleStep : public StepMap {
 public:
  explicit PaddleStep(const PaddleModel& model) : model_(model) {}
  int num_states() const override { return 2; }
  int num_controls() const override { return 1; }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override;
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override;

 private:
  const PaddleModel& model_;
};

}  // namespace tangible
