// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/ellipse.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/geometry/tolerances.h"

namespace tangible::internal {
namespace {

using Vector = Vector2<double>;

struct Separation {
  double value = 0.0;  ///< s, m
  double slope = 0.0;  ///< s', m
  double bend = 0.0;   ///< −s'', m
};

class Search {
 public:
  Search(const RoundShape& a, const RoundShape& b, const Vector& apart)
      : a_(a), b_(b), apart_(apart) {
    size_ =
        std::abs(apart.x()) + std::abs(apart.y()) + a.axes[0] + a.axes[1] + b.axes[0] + b.axes[1];
  }

  Vector Run() {
    Vector nearest;
    if (FindApart(&nearest)) {
      return nearest;
    }
    SampleDirections();
    const Vector up(0.0, 1.0);
    Vector best = up;
    double largest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < count_; ++i) {
      const Sample& first = samples_[i];
      const Sample& next = samples_[i + 1 == count_ ? 0 : i + 1];
      if (first.slope >= 0.0 && next.slope <= 0.0) {
        const Vector top = Refine(first, next);
        const double value = At(top).value;
        // Of directions with equal separations the first is kept, so that rounding does not decide.
        if (value > largest + kLengthRounding * size_) {
          largest = value;
          best = top;
        }
      }
    }
    const Separation at = At(best);
    const bool alike =
        IsUnbent(at.bend, size_) && at.value <= At(up).value + kLengthRounding * size_;
    return alike ? up : best;
  }

 private:
  struct Sample {
    Vector direction{0.0, 1.0};
    double angle = 0.0;
    double slope = 0.0;
  };
  // The number of directions of each ellipse, spread evenly over its eccentric anomaly: the slope
  // of the separation changes sign at most once between two of them, however slender the ellipse
  // is.
  static constexpr int kPerEllipse = 16;

  Vector Support(const RoundShape& shape, const Vector& n, double* bend) const {
    if (!(shape.axes[0] > 0.0)) {
      return Vector(0.0, 0.0);
    }
    // Lengths are in units of the larger axis, as in ellipse_inl.h.
    const double scale = std::max(shape.axes[0], shape.axes[1]);
    const double ratios[2] = {shape.axes[0] / scale, shape.axes[1] / scale};
    const Vector m = shape.rotation.Inverse(n);
    const Vector along(ratios[0] * m.x(), ratios[1] * m.y());
    const double height = std::sqrt(along.squaredNorm());
    const double curved = ratios[0] * ratios[1] / height;
    *bend += scale * curved * curved / height;
    return shape.rotation *
           Vector(shape.axes[0] * along.x() / height, shape.axes[1] * along.y() / height);
  }

  Separation At(const Vector& n) const {
    Separation result;
    const Vector w = apart_ + Support(a_, -n, &result.bend) - Support(b_, n, &result.bend);
    result.value = n.dot(w);
    result.slope = Cross(n, w);
    result.bend += result.value;
    return result;
  }

  // Newton's method from the line of centres. The directions that separate two shapes are one
  // interval, in which s is concave (3), so that a root there is the maximum.
  bool FindApart(Vector* direction) const {
    const double norm = std::sqrt(apart_.squaredNorm());
    if (!(norm > 0.0)) {
      return false;
    }
    Vector n = apart_ / norm;
    for (int k = 0; k < kNewtonSteps; ++k) {
      const Separation at = At(n);
      const double turn = at.slope / at.bend;
      if (IsUnbent(at.bend, size_) || !(std::abs(turn) < 1.0)) {
        return false;
      }
      if (std::abs(turn) <= kTurnRounding) {
        *direction = n;
        return at.value > 0.0;
      }
      n = n + turn * Perp(n);
      n = n / std::sqrt(n.squaredNorm());
    }
    return false;
  }

  void AddSample(const Vector& direction) {
    const double norm = std::sqrt(direction.squaredNorm());
    if (norm > 0.0) {
      Sample& sample = samples_[count_++];
      sample.direction = direction / norm;
      sample.angle = std::atan2(sample.direction.y(), sample.direction.x());
      sample.slope = At(sample.direction).slope;
    }
  }

  void SampleDirections() {
    AddSample(apart_);
    AddSample(-apart_);
    for (const RoundShape* shape : {&a_, &b_}) {
      if (shape->axes[0] > 0.0) {
        for (int k = 0; k < kPerEllipse; ++k) {
          const double anomaly = 2.0 * kPi / kPerEllipse * k;
          AddSample(shape->rotation *
                    Vector(shape->axes[1] * std::cos(anomaly), shape->axes[0] * std::sin(anomaly)));
        }
      }
    }
    std::sort(samples_, samples_ + count_,
              [](const Sample& x, const Sample& y) { return x.angle < y.angle; });
  }

  // The root of the slope between two directions less than half a turn apart, by Newton's steps
  // where they stay within the bracket and halve it, and by bisection otherwise.
  Vector Refine(const Sample& first, const Sample& last) const {
    if (first.slope == 0.0) {
      return first.direction;
    }
    if (last.slope == 0.0) {
      return last.direction;
    }
    Vector low = first.direction;
    Vector high = last.direction;
    Vector n = Middle(low, high);
    double last_turn = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMostSteps; ++k) {
      const Separation at = At(n);
      if (at.slope == 0.0 || !(Cross(low, high) > kTurnRounding)) {
        break;
      }
      (at.slope > 0.0 ? low : high) = n;
      const double turn = at.bend > 0.0 ? at.slope / at.bend : last_turn;
      Vector next = n + turn * Perp(n);
      next = next / std::sqrt(next.squaredNorm());
      const bool inside = Cross(low, next) > 0.0 && Cross(next, high) > 0.0;
      if (!inside || !(std::abs(turn) <= 0.5 * last_turn)) {
        next = Middle(low, high);
      }
      last_turn = std::abs(turn);
      if (last_turn <= kTurnRounding) {
        break;
      }
      n = next;
    }
    return n;
  }

  static Vector Middle(const Vector& low, const Vector& high) {
    const Vector sum = low + high;
    const double norm = std::sqrt(sum.squaredNorm());
    return norm > 0.0 ? Vector(sum / norm) : Perp(low);
  }

  static constexpr double kPi = 3.14159265358979323846;
  static constexpr int kNewtonSteps = 12;
  static constexpr int kMostSteps = 200;

  const RoundShape& a_;
  const RoundShape& b_;
  const Vector apart_;
  double size_;
  Sample samples_[2 * kPerEllipse + 2];
  int count_ = 0;
};

}  // namespace

Vector2<double> SeparatingDirection(const RoundShape& a, const RoundShape& b,
                                    const Vector2<double>& apart) {
  return Search(a, b, apart).Run();
}

bool IsUnbent(double bend, double size) { return !(bend > kUnbent * size); }

}  // namespace tangible::internal
