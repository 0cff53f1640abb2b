// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How the ball leaves what it meets: learned from what was seen, and before that as the engine's
// rigid bodies do without friction and loss.
//
// Where the game's contacts are not rigid ones: walls turn x alone, the ceiling and bricks y alone,
// whatever face or corner is met (prior); the speeds afterwards are those seen after the same
// contact at the same speed (learned), those of a row of bricks (learned), and from the paddle
// direction and speed follow from where the ball meets it (learned).

#include <map>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

enum class Meeting { kSide, kCeiling, kBrick, kPaddle };

class Responses {
 public:
  /// The velocity after the meeting (pixels/frame, y downwards). `row` of bricks; `offset` of the
  /// ball's left edge from the paddle's. `rigid`: what the engine says.
  Vector2<double> After(Meeting meeting, int row, double offset, const Vector2<double>& before,
                        const Vector2<double>& rigid) const;
  void Learn(Meeting meeting, int row, double offset, const Vector2<double>& before,
             const Vector2<double>& after);

  /// Points of a brick of that row, 1 before one was seen.
  double Points(int row) const;
  void LearnPoints(int row, double points) { points_[row] = points; }

  /// How many returns from the paddle were seen.
  int num_returns() const { return static_cast<int>(returns_.size()); }

 private:
  struct Return {
    double offset = 0.0;
    Vector2<double> before, after;
  };
  /// Of a speed that is met with: half pixels a frame, x and y.
  using Speed = std::pair<int, int>;
  static Speed SpeedOf(const Vector2<double>& v);
  Vector2<double> AfterPaddle(double offset, const Vector2<double>& before,
                              const Vector2<double>& rigid) const;

  std::map<std::pair<int, Speed>, Vector2<double>> speeds_;  ///< by what is met and at what speed
  std::map<int, Vector2<double>> of_row_;                    ///< last speed after a brick of a row
  std::vector<Return> returns_;
  std::map<int, double> points_;
};

}  // namespace tangible
