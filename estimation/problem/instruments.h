// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The instruments between a motion and its recording: sensors, cameras, clocks.
//
//   t = offset + rate τ − delay       time in the run of the value recorded at τ (clock, sensor)
//   d = r − origin − r_marker         or the position relative to another point
//   u = scale R(−rotation) d          in the camera's frame
//   w = (aspect u_x, u_y)             by pixels that are not square
//   image = w (1 + radial |w|² / (scale radial_length)²)   by the lens
//   recorded = gain image + bias      by the sensor
//
// rate is the number of seconds of the run in a second of the clock. A sensor with a delay shows at
// τ the value at τ − delay. Angles are recorded relative to the camera's rotation, velocities are
// those of the image, and angles and angular velocities know of no aspect or lens. Coordinates
// relative to another body or point are differences of two images, which need no origin unless
// there is a lens. Every number but radial_length, the distance at which the lens adds the part
// `radial`, may be a parameter of a fit: sensors/NAME/delay, gain, bias; cameras/NAME/scale,
// rotation, origin/x, origin/y, aspect, radial; clocks/NAME/rate, offset.

#include <string>
#include <vector>

#include "tangible/math/planar.h"
#include "tangible/scene/number_kind.h"

namespace tangible {

struct Sensor {
  std::string name;
  double delay = 0.0;  ///< s
  double gain = 1.0;
  double bias = 0.0;            ///< in the unit of the recorded value
  double sigma = 0.0;           ///< of its noise, in that unit; 0: the sigma of the observations
  bool estimate_sigma = false;  ///< sigma is the initial value of its estimate (fit/sensor_noise.h)
};

struct Camera {
  std::string name;
  double scale = 1.0;                ///< units of the image per metre, > 0
  double rotation = 0.0;             ///< rad: of its axes in the world
  Vector2<double> origin{0.0, 0.0};  ///< m: position of the image's (0, 0), from the marker if any
  int marker_body = -1;              ///< −1: none
  int marker_point = -1;             ///< −1: the body's centre of mass
  double aspect = 1.0;               ///< units along x per unit along y, > 0
  double radial = 0.0;               ///< what the lens adds at radial_length, as a part
  double radial_length = 0.0;        ///< m; 0: no lens, and radial is no parameter
};

/// What happens between two bodies (event_times.h).
enum class ObservedEventKind { kTouch, kLiftOff, kStick, kSlip, kRest };

/// An event whose times are recorded, of two bodies. An instrument records it at
///   recorded = gain (t + delay − offset) / rate + bias
struct ObservedEvent {
  std::string name;
  int bodies[2] = {-1, -1};
  ObservedEventKind kind = ObservedEventKind::kTouch;
};

/// Scale, rotation, origin/x, origin/y, aspect, radial.
inline constexpr int kCameraNumbers = 6;

struct Clock {
  std::string name;
  double rate = 1.0;    ///< > 0
  double offset = 0.0;  ///< s
};

struct Instruments {
  std::vector<Sensor> sensors;
  std::vector<Camera> cameras;
  std::vector<Clock> clocks;
  std::vector<ObservedEvent> events;

  /// Index in EnumerateNumbers of the first number of a sensor, camera or clock.
  int SensorNumber(int sensor) const { return 3 * sensor; }
  int CameraNumber(int camera) const {
    return 3 * static_cast<int>(sensors.size()) + kCameraNumbers * camera;
  }
  int ClockNumber(int clock) const {
    return CameraNumber(static_cast<int>(cameras.size())) + 2 * clock;
  }
};

/// How an observation was made: by which instruments, and relative to which body or point.
struct Channel {
  int file = 0;             ///< which of the files it is from
  int sensor = -1;          ///< index into the instruments; −1: none
  int camera = -1;          ///< the same
  int clock = -1;           ///< the same
  int to_body = -1;         ///< relative to this body; −1: to the world
  int to_point = -1;        ///< and this point of it; −1: its centre of mass
  bool body_frame = false;  ///< of accelerations: along the body's axes, not the world's
  bool gravity = false;     ///< of accelerations: a − g is shown

  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A number that a path can name.
struct InstrumentNumber {
  std::string path;  ///< "sensors/encoder/delay"
  double* value;     ///< points into the instruments
  NumberKind kind;
  bool moves_time = false;      ///< it changes the observed time of the run
  const char* needs = nullptr;  ///< a key without which it is no parameter, and which is not there
};

/// Delay, gain, bias of each sensor; scale, rotation, origin/x, origin/y, aspect, radial of each
/// camera; rate, offset of each clock.
std::vector<InstrumentNumber> EnumerateNumbers(Instruments* instruments);

/// t, in s of the run, of the value recorded at τ.
double RunTime(const Instruments& instruments, const Channel& channel, double recorded);

}  // namespace tangible
