// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state of a model: poses and twists of all its bodies, including those that never move.

#include <array>
#include <vector>

#include "tangible/math/planar.h"

namespace tangible {

/// What the friction of a body on the plane of motion does in a step (elements/support.h).
struct SupportState {
  enum Holds : int { kNothing = -2, kBody = -1 };  ///< from 0 on: the point that is held
  int holds = kNothing;
  /// In a motion between events: what moves so slowly that its velocity does not tell the direction
  /// of its friction; the twist below does.
  int slow = kNothing;
  /// While that twist is sought, the twist of the accelerations: friction is linearised about it.
  bool is_sought = false;
  /// The twist of the body about which the friction of the points that slide is linearised.
  std::array<double, 3> twist{};
  /// Where Newton's method goes round in circles: s > 0, m/s, and friction is −μ N v / √(v̂² + s²),
  /// a damper, in all that slides.
  double secant = 0.0;
  /// Of a body that creeps: τ > 0, s, and friction is sought against a + v / τ, the motion that is
  /// left after that time, instead of the accelerations alone (support.h).
  double horizon = 0.0;
  bool IsSlow(int point) const { return slow == kBody || slow == point; }
  friend bool operator==(const SupportState&, const SupportState&) = default;
};

/// Three numbers a body, in the model's order of bodies (the world is the last): (x, y, angle) in m
/// and rad, (vx, vy, omega) in m/s and rad/s. A static body's pose is a state that nothing changes,
/// so that derivatives with respect to it need no special case.
template <typename T>
struct State {
  std::vector<T> pose;
  std::vector<T> twist;
  /// During a motion without events: of each servo 0, or the sign of the bound at which it is held
  /// (servo.h). Empty: by its coordinate and rate.
  std::vector<signed char> servo_modes{};
  /// Of each joint whether it has been released (model_releases.h). Empty: none.
  std::vector<char> released{};
  /// Of each support; empty: supports do not act.
  std::vector<SupportState> supports{};

  Pose<T> PoseOf(int body) const {
    return Pose<T>(Vector2<T>(pose[3 * body], pose[3 * body + 1]), pose[3 * body + 2]);
  }
  friend bool operator==(const State&, const State&) = default;
};

/// The values of a state, without derivatives.
template <typename T>
State<double> ValuesOf(const State<T>& state) {
  State<double> values;
  for (const T& x : state.pose) {
    values.pose.push_back(ValueOf(x));
  }
  for (const T& x : state.twist) {
    values.twist.push_back(ValueOf(x));
  }
  values.servo_modes = state.servo_modes;
  values.released = state.released;
  values.supports = state.supports;
  return values;
}

}  // namespace tangible
