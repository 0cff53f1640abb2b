// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Predicts observations of a motion: the measured coordinate from the states of the bodies
// concerned (instruments.h has the equations), with its derivatives. The derivatives of the plain
// coordinates of a body or point are written by hand, because fits with many observations spend
// their time there; all others are evaluated in one Jet.

#include <array>

#include "tangible/estimation/problem/instruments.h"
#include "tangible/estimation/problem/observation.h"

namespace tangible {

/// A body or a point of it at the time of an observation.
struct Place {
  /// x, y, angle, vx, vy, omega, and for accelerations ax, ay, alpha; null: there is none.
  const double* state = nullptr;
  int point = -1;                ///< −1: the centre of mass
  Vector2<double> at{0.0, 0.0};  ///< m, body frame
};

/// The observed body, the body to which it is relative, and the camera's marker.
inline constexpr int kPlaces = 3;
inline constexpr int kPlaceNumbers = 9;
using ObservedPlaces = std::array<Place, kPlaces>;

/// A predicted coordinate with its derivatives.
struct Prediction {
  double value = 0.0;
  double by_state[kPlaces][kPlaceNumbers] = {};  ///< of each place
  double by_at[kPlaces][2] = {};                 ///< the place of the point in the body
  double by_sensor[2] = {};                      ///< gain, bias
  double by_gravity[2] = {};                     ///< of accelerations
  double by_camera[kCameraNumbers] = {};         ///< scale, rotation, origin x, y, aspect, radial
};

/// The coordinate, no acceleration, of a body or point without instruments.
Prediction PredictPlain(Coordinate coordinate, const Place& place);

/// The coordinate as it is recorded; `sensor` and `camera` may be null. At a distance of 0 its
/// derivative is that along x.
Prediction PredictRecorded(Coordinate coordinate, const ObservedPlaces& places,
                           const Sensor* sensor, const Camera* camera);

}  // namespace tangible
