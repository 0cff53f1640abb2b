// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/baselines.h"

#include <cmath>
#include <memory>

#include "tangible/estimation/experiments/breakout/agent/detector.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr double kDeadBand = 6.0;   // pixels: a press moves the paddle by more
constexpr int kLoopPictures = 400;  // without points: about four returns of a fast ball
constexpr double kAside = 5.0;      // pixels from the paddle's middle

// Detects the ball and moves the middle of the paddle to a place.
class Seer {
 public:
  // Returns false where the only useful button is the serve.
  bool See(const Picture& picture) {
    if (!detector_.started() && !detector_.Start(picture)) return false;
    const Sight sight = detector_.Look(picture);
    last_ = seen_ ? ball_ : Rectangle{0, -1, 0, 0};
    seen_ = sight.ball_seen;
    ball_ = sight.ball;
    if (sight.paddle_seen) paddle_ = sight.paddle;
    return seen_;
  }
  Button MoveTo(double x) const {
    const double off = x - (paddle_.x + 0.5 * paddle_.width);
    return off > kDeadBand ? Button::kRight : off < -kDeadBand ? Button::kLeft : Button::kNone;
  }
  double BallMiddle() const { return ball_.x + 0.5 * ball_.width; }
  /// The place at which the middle of the ball comes down if it meets side walls only; its current
  /// place while it rises.
  double ComesDown() const {
    const double vx = ball_.x - last_.x, vy = ball_.y - last_.y;
    if (last_.y < 0 || vy <= 0.0) return BallMiddle();
    const Arena& arena = detector_.arena();
    const double range = arena.right - arena.left - ball_.width;
    double x = ball_.x - arena.left + vx / vy * (arena.paddle_y - ball_.height - ball_.y);
    x = std::fmod(std::abs(x), 2.0 * range);
    return arena.left + (x > range ? 2.0 * range - x : x) + 0.5 * ball_.width;
  }

 private:
  Detector detector_;
  bool seen_ = false;
  Rectangle ball_, last_{0, -1, 0, 0}, paddle_;
};

}  // namespace

Player RandomPlayer(unsigned seed) {
  const auto random = std::make_shared<std::mt19937_64>(Generator(seed, 2));
  return [random](const Picture&, double, int) {
    return kButtons[static_cast<size_t>(Uniform(random.get()) * kButtons.size())];
  };
}

Player FollowingPlayer() {
  const auto seer = std::make_shared<Seer>();
  return [seer](const Picture& picture, double, int) {
    return seer->See(picture) ? seer->MoveTo(seer->BallMiddle()) : Button::kFire;
  };
}

Player InterceptingPlayer(unsigned seed) {
  struct Loop {
    Seer seer;
    int useless = 0;
    double aside = 0.0;
  };
  const auto loop = std::make_shared<Loop>();
  const auto random = std::make_shared<std::mt19937_64>(Generator(seed, 3));
  return [loop, random](const Picture& picture, double reward, int) {
    loop->useless = reward > 0.0 ? 0 : loop->useless + 1;
    if (reward > 0.0) loop->aside = 0.0;
    if (loop->useless > 0 && loop->useless % kLoopPictures == 0) {
      loop->aside = Uniform(-kAside, kAside, random.get());
    }
    return loop->seer.See(picture) ? loop->seer.MoveTo(loop->seer.ComesDown() + loop->aside)
                                   : Button::kFire;
  };
}

}  // namespace tangible
