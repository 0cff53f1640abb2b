// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/measurement.h"

#include <cmath>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

// Derivatives of a recorded value: state and point of each place, sensor, camera.
constexpr int kOfPlace = 8;
constexpr int kSensorAt = kPlaces * kOfPlace;
constexpr int kCameraAt = kSensorAt + 2;
using Local = Jet<kCameraAt + kCameraNumbers>;

/// Position, angle and their rates of a point.
struct Motion6 {
  Local x{0.0}, y{0.0}, angle{0.0}, vx{0.0}, vy{0.0}, omega{0.0};
};

Motion6 MotionOf(const Place& place, int index) {
  Motion6 motion;
  if (place.state == nullptr) {
    return motion;
  }
  const int at = index * kOfPlace;
  Local state[6];
  for (int i = 0; i < 6; ++i) {
    state[i] = Local(place.state[i], at + i);
  }
  const Local at_x(place.at.x(), at + 6);
  const Local at_y(place.at.y(), at + 7);
  const Local c = cos(state[2]);
  const Local s = sin(state[2]);
  const Local rx = c * at_x - s * at_y;
  const Local ry = s * at_x + c * at_y;
  motion.x = state[0] + rx;
  motion.y = state[1] + ry;
  motion.angle = state[2];
  motion.vx = state[3] - state[5] * ry;
  motion.vy = state[4] + state[5] * rx;
  motion.omega = state[5];
  return motion;
}

/// The difference a − b.
Motion6 Less(const Motion6& a, const Motion6& b) {
  return {a.x - b.x, a.y - b.y, a.angle - b.angle, a.vx - b.vx, a.vy - b.vy, a.omega - b.omega};
}

/// What of a motion in the image is read; the rest need not be turned, which is most of the time.
struct Needed {
  bool positions = true;
  bool velocities = true;
};

/// The motion in the camera's frame. For a relative motion the camera's origin is not subtracted,
/// nor its rotation from the angle.
Motion6 Seen(const Motion6& motion, const Camera& camera, const Motion6& marker, bool is_relative,
             Needed needed) {
  const Local scale(camera.scale, kCameraAt);
  const Local rotation(camera.rotation, kCameraAt + 1);
  const Local c = cos(rotation);
  const Local s = sin(rotation);
  Motion6 from = motion;
  if (!is_relative) {
    from.x -= marker.x + Local(camera.origin.x(), kCameraAt + 2);
    from.y -= marker.y + Local(camera.origin.y(), kCameraAt + 3);
    from.angle -= rotation;
    from.vx -= marker.vx;
    from.vy -= marker.vy;
  }
  Motion6 seen = from;
  const Local scale_x = scale * Local(camera.aspect, kCameraAt + 4);
  if (needed.positions) {
    seen.x = scale_x * (c * from.x + s * from.y);
    seen.y = scale * (c * from.y - s * from.x);
  }
  if (needed.velocities) {
    seen.vx = scale_x * (c * from.vx + s * from.vy);
    seen.vy = scale * (c * from.vy - s * from.vx);
  }
  return seen;
}

/// What the lens makes of positions and velocities in the image.
Motion6 ThroughLens(const Motion6& seen, const Camera& camera) {
  const Local length = Local(camera.scale, kCameraAt) * camera.radial_length;
  const Local part = Local(camera.radial, kCameraAt + 5) / (length * length);
  const Local stretch = 1.0 + part * (seen.x * seen.x + seen.y * seen.y);
  const Local rate = 2.0 * part * (seen.x * seen.vx + seen.y * seen.vy);
  Motion6 image = seen;
  image.x = seen.x * stretch;
  image.y = seen.y * stretch;
  image.vx = seen.vx * stretch + seen.x * rate;
  image.vy = seen.vy * stretch + seen.y * rate;
  return image;
}

Local Distance(const Motion6& relative) {
  const Local square = relative.x * relative.x + relative.y * relative.y;
  // The square root has no derivative at 0; that of |x| at 0 is set to 1.
  return square.a > 0.0 ? Local(sqrt(square)) : relative.x;
}

Local Pick(Coordinate coordinate, const Motion6& motion) {
  switch (coordinate) {
    case Coordinate::kX:
      return motion.x;
    case Coordinate::kY:
      return motion.y;
    case Coordinate::kAngle:
      return motion.angle;
    case Coordinate::kVx:
      return motion.vx;
    case Coordinate::kVy:
      return motion.vy;
    case Coordinate::kOmega:
      return motion.omega;
    case Coordinate::kDistance:
      return Distance(motion);
    case Coordinate::kAx:  // acceleration.h
    case Coordinate::kAy:
    case Coordinate::kAlpha:
    case Coordinate::kFx:  // force_rows.h
    case Coordinate::kFy:
    case Coordinate::kTorque:
    case Coordinate::kNormal:
    case Coordinate::kTangent:
    case Coordinate::kTime:  // no coordinate of a motion
      break;
  }
  return motion.x;
}

}  // namespace

Prediction PredictPlain(Coordinate coordinate, const Place& place) {
  const double* const state = place.state;
  const double c = std::cos(state[2]);
  const double s = std::sin(state[2]);
  const double rx = c * place.at.x() - s * place.at.y();
  const double ry = s * place.at.x() + c * place.at.y();
  Prediction prediction;
  double* const by_state = prediction.by_state[0];
  double* const by_at = prediction.by_at[0];
  switch (coordinate) {
    case Coordinate::kX:
      prediction.value = state[0] + rx;
      by_state[0] = 1.0;
      by_state[2] = -ry;
      by_at[0] = c;
      by_at[1] = -s;
      break;
    case Coordinate::kY:
      prediction.value = state[1] + ry;
      by_state[1] = 1.0;
      by_state[2] = rx;
      by_at[0] = s;
      by_at[1] = c;
      break;
    case Coordinate::kAngle:
      prediction.value = state[2];
      by_state[2] = 1.0;
      break;
    case Coordinate::kVx:
      prediction.value = state[3] - state[5] * ry;
      by_state[2] = -state[5] * rx;
      by_state[3] = 1.0;
      by_state[5] = -ry;
      by_at[0] = -state[5] * s;
      by_at[1] = -state[5] * c;
      break;
    case Coordinate::kVy:
      prediction.value = state[4] + state[5] * rx;
      by_state[2] = -state[5] * ry;
      by_state[4] = 1.0;
      by_state[5] = rx;
      by_at[0] = state[5] * c;
      by_at[1] = -state[5] * s;
      break;
    case Coordinate::kOmega:
      prediction.value = state[5];
      by_state[5] = 1.0;
      break;
    case Coordinate::kDistance:
      return PredictRecorded(coordinate, {place}, nullptr, nullptr);
    case Coordinate::kAx:  // acceleration.h
    case Coordinate::kAy:
    case Coordinate::kAlpha:
    case Coordinate::kFx:  // force_rows.h
    case Coordinate::kFy:
    case Coordinate::kTorque:
    case Coordinate::kNormal:
    case Coordinate::kTangent:
    case Coordinate::kTime:  // no coordinate of a motion
      break;
  }
  return prediction;
}

Prediction PredictRecorded(Coordinate coordinate, const ObservedPlaces& places,
                           const Sensor* sensor, const Camera* camera) {
  const bool is_relative = places[1].state != nullptr;
  const bool has_lens = camera != nullptr && camera->radial_length > 0.0;
  const bool is_velocity = coordinate == Coordinate::kVx || coordinate == Coordinate::kVy;
  // The velocity behind a lens depends on the position.
  const Needed needed{has_lens || !is_velocity, is_velocity};
  Motion6 motion = MotionOf(places[0], 0);
  if (has_lens) {
    // How far a lens moves a point depends on where it is, so that each has its own image.
    const Motion6 marker = MotionOf(places[2], 2);
    motion = ThroughLens(Seen(motion, *camera, marker, false, needed), *camera);
    if (is_relative) {
      const Motion6 other = Seen(MotionOf(places[1], 1), *camera, marker, false, needed);
      motion = Less(motion, ThroughLens(other, *camera));
    }
  } else {
    if (is_relative) {
      motion = Less(motion, MotionOf(places[1], 1));
    }
    if (camera != nullptr) {
      motion = Seen(motion, *camera, MotionOf(places[2], 2),
                    is_relative || coordinate == Coordinate::kDistance, needed);
    }
  }
  Local value = Pick(coordinate, motion);
  if (sensor != nullptr) {
    value = Local(sensor->gain, kSensorAt) * value + Local(sensor->bias, kSensorAt + 1);
  }
  Prediction prediction;
  prediction.value = value.a;
  for (int place = 0; place < kPlaces; ++place) {
    for (int i = 0; i < 6; ++i) {
      prediction.by_state[place][i] = value.v[place * kOfPlace + i];
    }
    for (int i = 0; i < 2; ++i) {
      prediction.by_at[place][i] = value.v[place * kOfPlace + 6 + i];
    }
  }
  for (int i = 0; i < 2; ++i) {
    prediction.by_sensor[i] = value.v[kSensorAt + i];
  }
  for (int i = 0; i < kCameraNumbers; ++i) {
    prediction.by_camera[i] = value.v[kCameraAt + i];
  }
  return prediction;
}

}  // namespace tangible
