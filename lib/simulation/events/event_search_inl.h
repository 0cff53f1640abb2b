// SPDX-License-Identifier: Apache-2.0
#pragma once
// Roots of functions of a segment's length. Included by event_search*.cc and servo_bounds.cc alone.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tangible/dynamics/elements/part_pairs.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

template <typename Visit>
void EventSearch::ForEachNearPart(const Model<double>& model, int a, int b,
                                  const Visit& visit) const {
  ForEachPartNear(model, a, segment_->before.PoseOf(a), boxes_[a], b, segment_->before.PoseOf(b),
                  boxes_[b], std::max(reach_[a], reach_[b]), visit);
}

inline bool Contains(const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
  return std::any_of(contacts.begin(), contacts.end(),
                     [&](const ActiveContact& c) { return c.SameAs(contact); });
}

// From so many closed contacts on the one whose mode ends first is looked for first, and what lets
// go together only by single contacts.
inline constexpr size_t kManyContacts = 12;
inline constexpr int kMostBisections = 1000;
inline constexpr int kMostRefinements = 200;
// A function that jumps is halved after so many steps.
inline constexpr int kMostSecants = 12;
// Of the last value: a root's search converges whose value falls below it.
inline constexpr double kConverges = 0.1;

// The root within (low, high) of the parabola through three values of a function, or NaN.
inline double RootOfParabola(double a, double fa, double b, double fb, double c, double fc,
                             double low, double high) {
  const double slope = (fb - fa) / (b - a);
  const double curvature = ((fc - fb) / (c - b) - slope) / (c - a);
  // About b: fb + rate (x − b) + curvature (x − b)².
  const double rate = slope + curvature * (b - a);
  const double square = rate * rate - 4.0 * curvature * fb;
  if (!(square >= 0.0)) return std::numeric_limits<double>::quiet_NaN();
  // The smaller root without cancellation, and the other one.
  const double q = -0.5 * (rate + std::copysign(std::sqrt(square), rate));
  for (const double x : {b + fb / q, b + q / curvature}) {
    if (x > low && x < high) return x;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// Muller's method within a bracket (gaps are nearly parabolas), with Illinois' variant of the
// secant method where the parabola has no root there, and halving where three steps have not halved
// the bracket and the last value did not fall: until |f| ≤ tolerance, or to the last bit that
// changes the value.
template <typename Function>
double EventSearch::Refine(const Model<double>& model, const Function& f, double tolerance,
                           double a, double fa, double b, double fb) {
  int same_side = 0;  // > 0: a was moved last, < 0: b
  double last_width = b - a;
  // The values of the ends, which Illinois' variant halves, and the last end that was replaced.
  double true_a = fa, true_b = fb;
  double old = std::numeric_limits<double>::quiet_NaN(), f_old = old;
  bool converges = false;
  double last = HUGE_VAL;
  for (int k = 1; k <= kMostRefinements && fb != 0.0; ++k) {
    const double width = b - a;
    if (width <= kBracket * b) {
      break;
    }
    bool halve = k > kMostSecants && !converges;
    if (k % 3 == 0) {
      halve = halve || (width > 0.5 * last_width && !converges);
      last_width = width;
    }
    double m = halve ? 0.5 * (a + b) : RootOfParabola(old, f_old, a, true_a, b, true_b, a, b);
    if (!(m > a && m < b)) {
      m = b - fb * width / (fb - fa);
    }
    if (!(m > a && m < b)) {
      m = 0.5 * (a + b);
    }
    if (m == a || m == b) {
      break;
    }
    const double fm = f(*At(model, m));
    if (std::isnan(fm)) {
      break;
    }
    if (std::abs(fm) <= tolerance) {
      return m;
    }
    converges = std::abs(fm) <= kConverges * last;
    last = std::abs(fm);
    if (fm > 0.0) {
      old = std::exchange(a, m);
      f_old = std::exchange(true_a, fm);
      fa = fm;
      if (same_side > 0) fb *= 0.5;
      same_side = 1;
    } else {
      old = std::exchange(b, m);
      f_old = std::exchange(true_b, fm);
      fb = fm;
      if (same_side < 0) fa *= 0.5;
      same_side = -1;
    }
  }
  return b;
}

// The conclusion about roots in an interval from the values and rates of change at both ends, for a
// function whose rate changes monotonically between them; otherwise there is none.
enum class Course { kUnknown, kNoRoot, kOneRoot };
inline Course CourseOf(double length, double fa, double rate_a, double fb, double rate_b) {
  constexpr double kSlack = 0.1;
  const double mean = (fb - fa) / length;
  // What changes the function by less than a part of its values is rounding, as of what moves along
  // with the other body.
  const double steady = fb > 0.0 ? std::min(fa, fb) / length : 0.0;
  const double most = kSlack * std::max({std::abs(rate_a), std::abs(rate_b), steady});
  if (!(mean >= std::min(rate_a, rate_b) - most && mean <= std::max(rate_a, rate_b) + most)) {
    return Course::kUnknown;  // the rate is not monotonic
  }
  if (fb <= 0.0) {
    return rate_b < 0.0 ? Course::kOneRoot : Course::kUnknown;
  }
  if (rate_a >= 0.0 || rate_b <= 0.0) {
    return Course::kNoRoot;  // the smaller end is the minimum
  }
  // The function lies above the tangents at both ends.
  const double at = std::clamp((fb - fa - rate_b * length) / (rate_a - rate_b), 0.0, length);
  return fa + rate_a * at > kSlack * std::min(fa, fb) ? Course::kNoRoot : Course::kUnknown;
}

// The conclusion, and the rates at both ends where they are known.
struct KnownCourse {
  Course course = Course::kUnknown;
  double rate_a = std::numeric_limits<double>::quiet_NaN();
  double rate_b = std::numeric_limits<double>::quiet_NaN();
};

// From this number of closed contacts on a motion costs so much that the rates at the ends of a
// bracket are used, which save evaluations of it; fewer keep the bits that they have had.
inline constexpr size_t kLeastContactsByRates = 12;
// Of the smaller value at the ends of a motion: what is larger at its half is not evaluated there.
inline constexpr double kClearOfHalf = 0.25;

// The cubic through the values and rates at both ends of [0, length].
class HermiteCubic {
 public:
  HermiteCubic(double length, double fa, double rate_a, double fb, double rate_b)
      : length_(length),
        fa_(fa),
        linear_(length * rate_a),
        square_(3.0 * (fb - fa) - length * (2.0 * rate_a + rate_b)),
        cube_(2.0 * (fa - fb) + length * (rate_a + rate_b)) {}
  double At(double x) const {
    const double u = x / length_;
    return fa_ + u * (linear_ + u * (square_ + u * cube_));
  }
  double RateAt(double x) const {
    const double u = x / length_;
    return (linear_ + u * (2.0 * square_ + 3.0 * u * cube_)) / length_;
  }
  // Its root, where it is positive at 0 and not at the other end, by halving.
  double Root() const {
    double low = 0.0, high = length_;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (At(middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }

 private:
  double length_, fa_, linear_, square_, cube_;
};

// Narrows the bracket [a, b] of a root of f by the root of the cubic through its ends and Newton's
// steps with the cubic's rates, as long as each takes nine tenths of the value away. Whether |f| ≤
// tolerance is met, at `root`.
template <typename Function>
bool NarrowByRates(const Function& f, const KnownCourse& known, double tolerance, double* a,
                   double* fa, double* b, double* fb, double* root) {
  const double start = *a;
  const HermiteCubic cubic(*b - *a, *fa, known.rate_a, *fb, known.rate_b);
  double at = start + cubic.Root();
  double last = kConverges * std::max(*fa, -*fb);
  for (int k = 0; k < kMostSecants && at > *a && at < *b; ++k) {
    const double value = f(at);
    if (std::isnan(value)) return false;
    if (std::abs(value) <= tolerance) {
      *root = at;
      return true;
    }
    (value > 0.0 ? *a : *b) = at;
    (value > 0.0 ? *fa : *fb) = value;
    if (!(std::abs(value) <= last)) return false;
    last = kConverges * std::abs(value);
    at -= value / cubic.RateAt(at - start);
  }
  return false;
}

template <typename Gap, typename Rate, typename CourseOver>
bool EventSearch::FirstRoot(const Model<double>& model, const Gap& gap, const Rate& rate_over,
                            const CourseOver& course_over, double tolerance, double from, double to,
                            double* root) {
  struct Interval {
    double a, fa, b, fb;
  };
  const double smallest = kShortestPart * to;
  double first = gap(*From(model, from));
  if (first <= 0.0 && from == 0.0) {
    // A contact without a gap that does not touch at the start is at a change of features: a corner
    // at the end of an edge, which it leaves.
    from = kLeftBehind * to;
    first = gap(*At(model, from));
    if (!(first > 0.0)) {
      return false;
    }
  } else if (first <= 0.0) {
    *root = from;
    return true;
  }
  const bool by_rates = segment_->contacts.size() >= kLeastContactsByRates;
  std::vector<Interval> open = {{from, first, to, gap(*At(model, to))}};
  Interval crossing = open.back();  // the shortest known to hold a crossing
  // Whether the root within an interval is found: not where the gap is infinite on the way, behind
  // which another crossing may be found.
  const auto refines = [&](const Interval& in) {
    bool is_known = true;
    const auto value = [&](const Sample& sample) {
      const double at = gap(sample);
      is_known = is_known && !std::isinf(at);
      return at;
    };
    *root = Refine(model, value, tolerance, in.a, in.fa, in.b, in.fb);
    return is_known || std::isinf(in.fa) || in.b - in.a <= smallest;
  };
  for (int k = 0; !open.empty(); ++k) {
    const Interval i = open.back();
    open.pop_back();
    if (i.fb <= 0.0) {
      crossing = i;
    }
    if (k == kMostBisections) {
      break;
    }
    if (std::isnan(i.fa) || std::isnan(i.fb)) {
      continue;
    }
    const double reach = i.b - i.a > smallest ? rate_over(i.a, i.b) * (i.b - i.a) : 0.0;
    // A gap that is infinite at one end alone, as of a body that is behind a run of an outline
    // there, may close as soon as the other end's allows.
    const double least = std::isinf(i.fa) != std::isinf(i.fb) ? std::min(i.fa, i.fb) : i.fa + i.fb;
    if (i.fb > 0.0 && (least > reach || i.b - i.a <= smallest)) {
      continue;
    }
    const KnownCourse known = course_over(i.a, i.fa, i.b, i.fb);
    if (known.course == Course::kNoRoot) {
      continue;
    }
    if (known.course == Course::kOneRoot) {
      Interval in = i;
      const auto value = [&](double at) { return gap(*At(model, at)); };
      if (by_rates && i.fb < 0.0 && std::isfinite(known.rate_a) &&
          NarrowByRates(value, known, tolerance, &in.a, &in.fa, &in.b, &in.fb, root)) {
        return true;
      }
      if (refines(in)) return true;
    }
    // Where the gap closes by more than half of what the bound allows it does not open in between:
    // the crossing is the first.
    const bool is_first = i.b - i.a <= smallest || i.fa - i.fb > 0.5 * reach;
    if (i.fb <= 0.0 && is_first && refines(i)) return true;
    const double m = 0.5 * (i.a + i.b);
    const double fm = gap(*At(model, m));
    if (fm > 0.0) {
      open.push_back({m, fm, i.b, i.fb});
    }
    open.push_back({i.a, i.fa, m, fm});
  }
  if (crossing.fb <= 0.0) {
    *root = Refine(model, gap, tolerance, crossing.a, crossing.fa, crossing.b, crossing.fb);
    return true;
  }
  return false;
}

}  // namespace tangible
