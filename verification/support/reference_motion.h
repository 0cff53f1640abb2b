// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Motions of one coordinate, and of a disc on a level floor, that are known exactly: in continuous
// time (event stepping), and of fixed steps (lib/dynamics/elements/contact.h). They take every
// number in long double with its derivative, and are analytic between values at which an event
// changes places with another event or with an end; so their derivatives beside such a value tend
// to the one-sided ones at it.

#include <cmath>
#include <compare>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

/// A number with its derivative by one parameter.
struct Real {
  long double value = 0.0L;
  long double rate = 0.0L;

  constexpr Real() = default;
  constexpr Real(long double v, long double r = 0.0L)  // NOLINT(google-explicit-constructor)
      : value(v), rate(r) {}
  explicit operator double() const { return static_cast<double>(value); }

  Real& operator+=(const Real& y) { return *this = *this + y; }
  Real& operator-=(const Real& y) { return *this = *this - y; }
  friend Real operator-(const Real& x) { return {-x.value, -x.rate}; }
  friend Real operator+(const Real& x, const Real& y) {
    return {x.value + y.value, x.rate + y.rate};
  }
  friend Real operator-(const Real& x, const Real& y) {
    return {x.value - y.value, x.rate - y.rate};
  }
  friend Real operator*(const Real& x, const Real& y) {
    return {x.value * y.value, x.rate * y.value + x.value * y.rate};
  }
  friend Real operator/(const Real& x, const Real& y) {
    const long double ratio = x.value / y.value;
    return {ratio, (x.rate - ratio * y.rate) / y.value};
  }
  friend bool operator==(const Real& x, const Real& y) { return x.value == y.value; }
  friend auto operator<=>(const Real& x, const Real& y) { return x.value <=> y.value; }
  friend Real abs(const Real& x) { return x.value < 0.0L ? -x : x; }
  /// At 0 the rate is that of a number that stays 0.
  friend Real sqrt(const Real& x) {
    const long double root = std::sqrt(x.value);
    return {root, root > 0.0L ? x.rate / (2.0L * root) : 0.0L};
  }
  friend Real sin(const Real& x) { return {std::sin(x.value), std::cos(x.value) * x.rate}; }
  friend Real cos(const Real& x) { return {std::cos(x.value), -std::sin(x.value) * x.rate}; }
  friend Real exp(const Real& x) {
    const long double power = std::exp(x.value);
    return {power, power * x.rate};
  }
  friend Real hypot(const Real& x, const Real& y) { return sqrt(x * x + y * y); }
};

/// A force that is piecewise linear in time.
struct Load {
  struct Window {
    Real start, end, force;
  };
  Real constant = 0.0L;
  std::vector<Window> windows;
  /// A signal with linear interpolation, its ends held; or none.
  std::vector<Real> times, values;

  /// The value at `time`, by the piece that contains `middle`, and its slope.
  Real At(Real time, Real middle, Real* slope) const;
  /// The integral over [from, to].
  Real Impulse(Real from, Real to) const;
  /// The times in (from, to) at which a piece ends, `from` and `to`, ascending.
  std::vector<Real> Pieces(Real from, Real to) const;
};

/// When a run ends, and how it is stepped.
struct Course {
  Stepping stepping = Stepping::kFixed;
  Real dt = 0.01L;
  Real duration = 1.0L;
  int steps = 100;  ///< of fixed stepping; the last ends with the duration

  /// When step k of fixed stepping starts, and the one before it ends.
  Real StepEnd(int k) const;
};

struct Coordinate {
  Real position = 0.0L;
  Real speed = 0.0L;
};

/// A mass (or an inertia) that dry friction of at most `friction` (N, N m) holds or slows.
Coordinate Slide(Coordinate at, Real mass, Real friction, const Load& load, const Course& course);

struct Surface {
  Real restitution = 0.0L;
  Real threshold = 1e-3L;      ///< of the approach speed, below which an impact is inelastic
  Real margin = 1e-4L;         ///< m, of fixed steps
  Real recovery_speed = 3.0L;  ///< m/s, of fixed steps
};

/// Friction that falls with the speed v to kinetic + (friction − kinetic) exp(−(v / speed)²).
struct Stribeck {
  Real friction, kinetic, speed;

  Real ForceAt(Real v) const;
};

/// The time in which such friction alone stops a mass that moves with speed v.
Real TimeToStop(Real mass, const Stribeck& law, Real v);

/// The same as Slide in continuous time: from speed v without a load, or from rest by a load that
/// grows in proportion to time beyond what holds, on either side.
Coordinate SlideByStribeck(Coordinate at, Real mass, const Stribeck& law, const Load& load,
                           Real duration);

/// A gap of a mass from a surface that it cannot enter. While the load changes with time the mass
/// must not fall back onto the surface.
Coordinate Bounce(Coordinate gap, Real mass, const Surface& surface, const Load& load,
                  const Course& course);

/// The least speed of a gap that a fixed step of length h leaves, from a speed of `free` without
/// the contact.
Real LeastSpeed(const Coordinate& gap, Real free, Real h, const Surface& surface);

struct Disc {
  Coordinate along;  ///< the centre, along the floor
  Coordinate gap;
  Coordinate turn;  ///< angle and angular velocity
};

/// A disc above a level floor: it falls, bounces, slides and rolls under the weight and no other
/// force.
Disc FallAndRoll(Disc disc, Real radius, Real mass, Real inertia, Real friction, Real gravity,
                 const Surface& surface, const Course& course);

}  // namespace tangible
