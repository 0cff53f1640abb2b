// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/acceleration.h"

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

// Derivatives: state with acceleration, point, sensor, gravity.
constexpr int kPointAt = kPlaceNumbers;
constexpr int kGainAt = kPointAt + 2;
constexpr int kGravityAt = kGainAt + 2;
using AccelerationJet = Jet<kGravityAt + 2>;

AccelerationJet Shown(Coordinate coordinate, const Place& place,
                      const AccelerationOptions& options) {
  AccelerationJet state[kPlaceNumbers];
  for (int i = 0; i < kPlaceNumbers; ++i) state[i] = AccelerationJet(place.state[i], i);
  const AccelerationJet& alpha = state[8];
  if (coordinate == Coordinate::kAlpha) return alpha;
  const AccelerationJet at_x(place.at.x(), kPointAt);
  const AccelerationJet at_y(place.at.y(), kPointAt + 1);
  const AccelerationJet c = cos(state[2]);
  const AccelerationJet s = sin(state[2]);
  const AccelerationJet rx = c * at_x - s * at_y;
  const AccelerationJet ry = s * at_x + c * at_y;
  const AccelerationJet square = state[5] * state[5];
  AccelerationJet x = state[6] - alpha * ry - square * rx;
  AccelerationJet y = state[7] + alpha * rx - square * ry;
  if (options.gravity) {
    x -= AccelerationJet(options.g.x(), kGravityAt);
    y -= AccelerationJet(options.g.y(), kGravityAt + 1);
  }
  if (!options.body_frame) return coordinate == Coordinate::kAx ? x : y;
  return coordinate == Coordinate::kAx ? AccelerationJet(c * x + s * y)
                                       : AccelerationJet(c * y - s * x);
}

}  // namespace

Prediction PredictAcceleration(Coordinate coordinate, const Place& place,
                               const AccelerationOptions& options, const Sensor* sensor) {
  AccelerationJet value = Shown(coordinate, place, options);
  if (sensor != nullptr) {
    value =
        AccelerationJet(sensor->gain, kGainAt) * value + AccelerationJet(sensor->bias, kGainAt + 1);
  }
  Prediction prediction;
  prediction.value = value.a;
  for (int i = 0; i < kPlaceNumbers; ++i) prediction.by_state[0][i] = value.v[i];
  for (int i = 0; i < 2; ++i) {
    prediction.by_at[0][i] = value.v[kPointAt + i];
    prediction.by_sensor[i] = value.v[kGainAt + i];
    prediction.by_gravity[i] = value.v[kGravityAt + i];
  }
  return prediction;
}

}  // namespace tangible
