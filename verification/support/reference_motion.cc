// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/reference_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/scene/scene_names.h"
#include "tangible/verification/support/extrapolation.h"

namespace tangible {
namespace {

constexpr Real kNever = std::numeric_limits<long double>::infinity();
constexpr int kMostEvents = 1000;
constexpr int kStribeckSteps = 8;  // of order 16, of speeds far below those at which friction falls

Real Sign(Real x) { return x > 0.0L ? 1.0L : x < 0.0L ? -1.0L : 0.0L; }

// The smallest root > 0 of a + b τ + c τ² where the value is ≥ 0 before and falls through 0;
// infinite if there is none. A value of 0 at τ = 0 that grows at first is no root.
Real FallsThroughZero(Real a, Real b, Real c) {
  if (a <= 0.0L && (b < 0.0L || (b == 0.0L && c < 0.0L))) return 0.0L;
  if (c == 0.0L) return b < 0.0L ? -a / b : kNever;
  const Real square = b * b - 4.0L * a * c;
  if (square < 0.0L) return kNever;
  // The root at which the slope is −√square.
  const Real root = sqrt(square);
  if (b > 0.0L) return c < 0.0L ? (-b - root) / (2.0L * c) : kNever;
  const Real below = -b + root;
  return below > 0.0L ? 2.0L * a / below : kNever;
}

// A piece of the load, and a motion in it.
struct Piece {
  Real from, to;  // s
  Real force, slope;
};

Piece PieceAt(const Load& load, Real from, Real to) {
  Piece piece{from, to, 0.0L, 0.0L};
  piece.force = load.At(from, 0.5L * (from + to), &piece.slope);
  return piece;
}

void Advance(Real acceleration, Real slope, Real time, Coordinate* at) {
  at->position += time * (at->speed + time * (acceleration / 2.0L + time * slope / 6.0L));
  at->speed += time * (acceleration + time * slope / 2.0L);
}

// In which direction a mass at rest begins to slide at once; 0: friction holds it.
Real SlidesAtOnce(Real force, Real slope, Real friction) {
  const Real side = force != 0.0L ? Sign(force) : Sign(slope);
  const Real excess = abs(force) - friction;
  return excess > 0.0L || (excess == 0.0L && side * slope > 0.0L) ? side : 0.0L;
}

// Until friction no longer holds a mass at rest.
Real BreaksLooseAfter(Real force, Real slope, Real friction) {
  return slope == 0.0L ? kNever : (friction - Sign(slope) * force) / abs(slope);
}

void SlidePiece(Piece piece, Real mass, Real friction, Coordinate* at) {
  for (int event = 0; event < kMostEvents && piece.from < piece.to; ++event) {
    const Real left = piece.to - piece.from;
    const Real side =
        at->speed != 0.0L ? Sign(at->speed) : SlidesAtOnce(piece.force, piece.slope, friction);
    Real time = left;
    if (side == 0.0L) {
      time = std::min(left, BreaksLooseAfter(piece.force, piece.slope, friction));
    } else {
      const Real acceleration = (piece.force - side * friction) / mass;
      const Real slope = piece.slope / mass;
      const Real stops =
          FallsThroughZero(side * at->speed, side * acceleration, side * slope / 2.0L);
      time = std::min(left, stops);
      Advance(acceleration, slope, time, at);
      at->speed = stops <= left ? 0.0L : at->speed;
    }
    piece.from += time;
    piece.force += time * piece.slope;
    if (side == 0.0L && time < left) {
      // The rounding of the moment must not hold it for another moment.
      piece.force = Sign(piece.slope) * friction;
    }
  }
}

void BouncePiece(Piece piece, Real mass, const Surface& surface, Coordinate* gap) {
  for (int event = 0; event < kMostEvents && piece.from < piece.to; ++event) {
    const Real left = piece.to - piece.from;
    const bool pressed = piece.force < 0.0L || (piece.force == 0.0L && piece.slope <= 0.0L);
    Real time = left;
    if (gap->position <= 0.0L && gap->speed == 0.0L && pressed) {
      const bool leaves = piece.slope > 0.0L;
      time = leaves ? std::min(left, -piece.force / piece.slope) : left;
      piece.force = leaves && time < left ? 0.0L : piece.force + time * piece.slope;
      piece.from += time;
      continue;
    }
    const Real acceleration = piece.force / mass;
    const Real touches = piece.slope == 0.0L
                             ? FallsThroughZero(gap->position, gap->speed, acceleration / 2.0L)
                             : kNever;
    time = std::min(left, touches);
    Advance(acceleration, piece.slope / mass, time, gap);
    if (touches <= left) {
      gap->speed = gap->speed < -surface.threshold ? -surface.restitution * gap->speed : 0.0L;
      // In the surface as the run starts, it leaves from where it is, or is pushed out.
      if (gap->speed == 0.0L || gap->position > 0.0L || time > 0.0L) gap->position = 0.0L;
    }
    piece.from += time;
    piece.force += time * piece.slope;
  }
}

// The new speed of a gap in a fixed step of length h.
Real SpeedAfterStep(const Coordinate& gap, Real free, Real h, const Surface& surface) {
  return std::max(free, LeastSpeed(gap, free, h, surface));
}

// The impulse of friction on the slip of a disc, at most `most`; `arm`: from the centre to where it
// acts.
void Rub(Real most, Real arm, Real mass, Real inertia, Disc* disc) {
  const Real slip = disc->along.speed + arm * disc->turn.speed;
  const Real holds = slip / (1.0L / mass + arm * arm / inertia);
  const Real impulse = std::clamp(-holds, -most, most);
  disc->along.speed += impulse / mass;
  disc->turn.speed += arm * impulse / inertia;
  if (abs(holds) <= most) disc->along.speed = -arm * disc->turn.speed;
}

Disc FallByEvents(Disc disc, Real radius, Real mass, Real inertia, Real friction, Real gravity,
                  const Surface& surface, Real duration) {
  Real left = duration;
  for (int event = 0; event < kMostEvents && left > 0.0L; ++event) {
    const bool rests = disc.gap.position <= 0.0L && disc.gap.speed == 0.0L;
    const Real slip = disc.along.speed + radius * disc.turn.speed;
    const Real pull = rests ? -Sign(slip) * friction * gravity : 0.0L;  // m/s²
    const Real turning = pull * mass * radius / inertia;
    const Real slowing = abs(pull) + radius * abs(turning);
    const Real ends = rests ? (slowing > 0.0L ? abs(slip) / slowing : kNever)
                            : FallsThroughZero(disc.gap.position, disc.gap.speed, -gravity / 2.0L);
    const Real time = std::min(left, ends);
    Advance(pull, 0.0L, time, &disc.along);
    Advance(turning, 0.0L, time, &disc.turn);
    if (!rests) Advance(-gravity, 0.0L, time, &disc.gap);
    if (ends <= left && rests) {
      disc.along.speed = -radius * disc.turn.speed;
    } else if (ends <= left) {
      const Real old = disc.gap.speed;
      disc.gap = {0.0L, old < -surface.threshold ? -surface.restitution * old : 0.0L};
      Rub(friction * mass * (disc.gap.speed - old), radius, mass, inertia, &disc);
    }
    left -= time;
  }
  return disc;
}

// A mass that moves with speed v ≥ 0 along a load of `force` + `slope` t, for `time`.
Coordinate DriveByStribeck(Real v, Real mass, const Stribeck& law, Real force, Real slope,
                           Real time) {
  const auto rates = [&](const std::vector<Real>& y) {  // position, speed, t
    return std::vector<Real>{y[1], (force + slope * y[2] - law.ForceAt(y[1])) / mass, 1.0L};
  };
  const std::vector<Real> end = Extrapolate<Real>(rates, {0.0L, v, 0.0L}, time, kStribeckSteps);
  return {end[0], end[1]};
}

struct Stop {
  Real time, way;
};

// Where and when it stops without a load.
Stop StopByStribeck(Real v, Real mass, const Stribeck& law) {
  const auto rates = [&](const std::vector<Real>& y) {  // speed, time, way over v − speed
    const Real slows = law.ForceAt(y[0]) / mass;
    return std::vector<Real>{-v, v / slows, v * y[0] / slows};
  };
  const std::vector<Real> end = Extrapolate<Real>(rates, {v, 0.0L, 0.0L}, 1.0L, kStribeckSteps);
  return {end[1], end[2]};
}

}  // namespace

Real Course::StepEnd(int k) const { return k >= steps ? duration : std::min(k * dt, duration); }

Real LeastSpeed(const Coordinate& gap, Real free, Real h, const Surface& surface) {
  const bool rebounds = surface.restitution > 0.0L && gap.speed < -surface.threshold &&
                        gap.position + h * free < surface.margin;
  const Real constant = std::max(gap.position / h, -surface.recovery_speed);
  if (!rebounds) return -constant;
  const Real rebound = surface.restitution * gap.speed;
  return -(gap.position >= 0.0L ? rebound : std::min(rebound, constant));
}

Real Stribeck::ForceAt(Real v) const {
  return kinetic + (friction - kinetic) * exp(-(v / speed) * (v / speed));
}

Real TimeToStop(Real mass, const Stribeck& law, Real v) {
  return StopByStribeck(v, mass, law).time;
}

Coordinate SlideByStribeck(Coordinate at, Real mass, const Stribeck& law, const Load& load,
                           Real duration) {
  Real slope = 0.0L;
  const Real force = load.At(0.0L, 0.5L * duration, &slope);
  const Real side = at.speed != 0.0L ? Sign(at.speed) : Sign(slope);
  if (at.speed != 0.0L) {
    const Stop stop = StopByStribeck(abs(at.speed), mass, law);
    if (stop.time <= duration) return {at.position + side * stop.way, 0.0L};
  }
  const Real holds =
      at.speed != 0.0L ? 0.0L : std::max(BreaksLooseAfter(force, slope, law.friction), Real());
  if (holds >= duration) return at;
  const Coordinate moved = DriveByStribeck(abs(at.speed), mass, law, side * (force + slope * holds),
                                           abs(slope), duration - holds);
  return {at.position + side * moved.position, side * moved.speed};
}

Real Load::At(Real time, Real middle, Real* slope) const {
  Real force = constant;
  *slope = 0.0L;
  for (const Window& window : windows) {
    force += window.start <= middle && middle < window.end ? window.force : 0.0L;
  }
  if (!times.empty()) {
    const size_t after =
        static_cast<size_t>(std::upper_bound(times.begin(), times.end(), middle) - times.begin());
    if (after == 0 || after == times.size()) {
      force += after == 0 ? values.front() : values.back();
    } else {
      *slope = (values[after] - values[after - 1]) / (times[after] - times[after - 1]);
      force += values[after - 1] + *slope * (time - times[after - 1]);
    }
  }
  return force;
}

Real Load::Impulse(Real from, Real to) const {
  const std::vector<Real> pieces = Pieces(from, to);
  Real impulse = 0.0L;
  for (size_t i = 0; i + 1 < pieces.size(); ++i) {
    const Real middle = 0.5L * (pieces[i] + pieces[i + 1]);
    Real slope = 0.0L;
    impulse += At(middle, middle, &slope) * (pieces[i + 1] - pieces[i]);
  }
  return impulse;
}

std::vector<Real> Load::Pieces(Real from, Real to) const {
  std::vector<Real> pieces = {from, to};
  const auto add = [&](Real time) {
    if (from < time && time < to) pieces.push_back(time);
  };
  for (const Window& window : windows) {
    add(window.start);
    add(window.end);
  }
  std::for_each(times.begin(), times.end(), add);
  std::sort(pieces.begin(), pieces.end());
  return pieces;
}

Coordinate Slide(Coordinate at, Real mass, Real friction, const Load& load, const Course& course) {
  if (course.stepping == Stepping::kEvent) {
    const std::vector<Real> pieces = load.Pieces(0.0L, course.duration);
    for (size_t i = 0; i + 1 < pieces.size(); ++i) {
      SlidePiece(PieceAt(load, pieces[i], pieces[i + 1]), mass, friction, &at);
    }
    return at;
  }
  for (int k = 0; k < course.steps; ++k) {
    const Real from = course.StepEnd(k);
    const Real h = course.StepEnd(k + 1) - from;
    const Real free = at.speed + load.Impulse(from, from + h) / mass;
    at.speed = Sign(free) * std::max(abs(free) - friction * h / mass, Real());
    at.position += h * at.speed;
  }
  return at;
}

Coordinate Bounce(Coordinate gap, Real mass, const Surface& surface, const Load& load,
                  const Course& course) {
  if (course.stepping == Stepping::kEvent) {
    const std::vector<Real> pieces = load.Pieces(0.0L, course.duration);
    for (size_t i = 0; i + 1 < pieces.size(); ++i) {
      BouncePiece(PieceAt(load, pieces[i], pieces[i + 1]), mass, surface, &gap);
    }
    return gap;
  }
  for (int k = 0; k < course.steps; ++k) {
    const Real from = course.StepEnd(k);
    const Real h = course.StepEnd(k + 1) - from;
    const Real free = gap.speed + load.Impulse(from, from + h) / mass;
    gap.speed = SpeedAfterStep(gap, free, h, surface);
    gap.position += h * gap.speed;
  }
  return gap;
}

Disc FallAndRoll(Disc disc, Real radius, Real mass, Real inertia, Real friction, Real gravity,
                 const Surface& surface, const Course& course) {
  if (course.stepping == Stepping::kEvent) {
    return FallByEvents(disc, radius, mass, inertia, friction, gravity, surface, course.duration);
  }
  for (int k = 0; k < course.steps; ++k) {
    const Real h = course.StepEnd(k + 1) - course.StepEnd(k);
    const Real free = disc.gap.speed - gravity * h;
    // Friction acts in the middle of the gap as the step starts.
    const Real arm = radius + 0.5L * disc.gap.position;
    disc.gap.speed = SpeedAfterStep(disc.gap, free, h, surface);
    Rub(friction * mass * (disc.gap.speed - free), arm, mass, inertia, &disc);
    disc.along.position += h * disc.along.speed;
    disc.turn.position += h * disc.turn.speed;
    disc.gap.position += h * disc.gap.speed;
  }
  return disc;
}

}  // namespace tangible
