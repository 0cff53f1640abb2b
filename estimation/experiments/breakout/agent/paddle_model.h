// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The response of the paddle to buttons: a body that is pushed against drag, learned from its
// places.
//
// In each frame, with u = −1, 0 or 1 for left, none, right (pixels, frames):
//
//   w  = β v where u v < 0, else v           a press against the motion keeps the share β
//   v⁺ = (1 − d₀ − (d₁ − d₀) |u|) w + a u    drag d₀ of a free paddle and d₁ of a pressed one
//   x⁺ = x + v⁺, stopped by the walls
//
// The four parameters minimise the squared errors of the displacements over four frames each
// (estimation/fit). The residual of the law has a mean and a variance for each situation, which are
// learned as well. A situation is the last three buttons, the wall at which the step begins, and
// whether the step before began at one; left and right are symmetric. The game moves the paddle by
// whole pixels, which no law of this form describes, and sticky buttons make the response random.

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
  /// Uses the range of x between low and high.
  PaddleModel(double low, double high) : low_(low), high_(high) {}

  double low() const { return low_; }
  double high() const { return high_; }
  const PaddleNumbers& numbers() const { return numbers_; }
  void set_numbers(const PaddleNumbers& numbers) { numbers_ = numbers; }

  /// The state after `frames` ≤ kFrameSkip of a step in that direction.
  PaddleState After(const PaddleState& state, int direction, int frames) const;
  PaddleState After(const PaddleState& state, int direction) const {
    return After(state, direction, kFrameSkip);
  }
  /// The variance of the place after a step in that direction, pixels².
  double Variance(const PaddleState& state, int direction) const;
  /// Records that a step ended at x, and returns the state there.
  PaddleState Learn(const PaddleState& before, int direction, double x);
  /// The displacement in the last of three steps from rest, far from the walls, pixels, which is
  /// compared with the truth.
  double Way(int first, int second, int third) const;
  /// Estimates the parameters from the steps so far; returns false where there are too few.
  bool Fit();
  /// The root mean square of the residuals of law and means over the last steps that end away from
  /// walls, pixels.
  double Uncertainty() const;
  int num_steps() const { return static_cast<int>(steps_.size()); }

  /// A paddle at x of which nothing else is known.
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
  /// The residuals of the law in a situation.
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

/// The law, without the means, as a step for plans: states x, v; the control u in [−1, 1].
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
