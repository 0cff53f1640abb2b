// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What an accelerometer at a point of a body shows, from the body's state and acceleration:
//
//   a_p = a + alpha (−r_y, r_x) − omega² r,  r = R(angle) at   of the point in the world
//   f = a_p − g                            with gravity (at rest 9.81 upwards)
//   shown = R(−angle) f                    in the frame of the body
//   recorded = gain shown + bias           by the sensor

#include "tangible/estimation/problem/measurement.h"

namespace tangible {

struct AccelerationOptions {
  bool body_frame = false;
  bool gravity = false;
  Vector2<double> g{0.0, 0.0};  ///< m/s²
};

/// `place` has x, y, angle, vx, vy, omega, ax, ay, alpha; `sensor` may be null.
Prediction PredictAcceleration(Coordinate coordinate, const Place& place,
                               const AccelerationOptions& options, const Sensor* sensor);

}  // namespace tangible
