// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The velocity of the ball after a contact: learned, and before that the velocity of the engine's
// rigid bodies without friction and loss.
//
// Contacts of the game differ from rigid ones. Walls reverse x only, the ceiling and bricks y only,
// whatever face or corner is met (prior). The speed after a contact is the one seen after the same
// contact at the same speed (learned), or after a brick of the same row (learned). After the
// paddle, direction and speed follow from the place where the ball meets it (learned).

#include <map>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

enum class Meeting { kSide, kCeiling, kBrick, kPaddle };

class Responses {
 public:
  /// The velocity after the contact (pixels/frame, y downwards). `row`: of a brick; `offset`: of
  /// the ball's left edge from the paddle's; `rigid`: the velocity by the engine.
  Vector2<double> After(Meeting meeting, int row, double offset, const Vector2<double>& before,
                        const Vector2<double>& rigid) const;
  void Learn(Meeting meeting, int row, double offset, const Vector2<double>& before,
             const Vector2<double>& after);

  /// The points of a brick of that row; 1 before one was broken.
  double Points(int row) const;
  void LearnPoints(int row, double points) { points_[row] = points; }

  /// The number of recorded returns from the paddle.
  int num_returns() const { return static_cast<int>(returns_.size()); }

 private:
  struct Return {
    double offset = 0.0;
    Vector2<double> before, after;
  };
  /// A speed before a contact, in half pixels a frame, x and y.
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
