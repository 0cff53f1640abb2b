// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The instruments between a motion and its recording: sensors, cameras, clocks.
//
//   t = offset + rate τ − delay       time in the run of the value recorded at τ (clock, sensor)
//   d = r − origin − r_marker         or the position relative to another point
//   u = scale R(−rotation) d          in the camera's frame
//   recorded = gain u + bias          by the sensor
//
// rate is the number of seconds of the run in a second of the clock. A sensor with a delay shows at
// τ the value at τ − delay. Angles are recorded relative to the camera's rotation, velocities are
// turned and scaled like positions, and angular velocities are unchanged. Coordinates relative to
// another body or point need no origin. Every number may be a parameter of a fit:
// sensors/NAME/delay, gain, bias; cameras/NAME/scale, rotation, origin/x, origin/y;
// clocks/NAME/rate, offset.

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
};

struct Clock {
  std::string name;
  double rate = 1.0;    ///< > 0
  double offset = 0.0;  ///< s
};

struct Instruments {
  std::vector<Sensor> sensors;
  std::vector<Camera> cameras;
  std::vector<Clock> clocks;

  /// Index in EnumerateNumbers of the first number of a sensor, camera or clock.
  int SensorNumber(int sensor) const { return 3 * sensor; }
  int CameraNumber(int camera) const { return 3 * static_cast<int>(sensors.size()) + 4 * camera; }
  int ClockNumber(int clock) const {
    return CameraNumber(static_cast<int>(cameras.size())) + 2 * clock;
  }
};

/// How an observation was made: by which instruments, and relative to which body or point.
struct Channel {
  int file = 0;       ///< which of the files it is from
  int sensor = -1;    ///< index into the instruments; −1: none
  int camera = -1;    ///< the same
  int clock = -1;     ///< the same
  int to_body = -1;   ///< relative to this body; −1: to the world
  int to_point = -1;  ///< and this point of it; −1: its centre of mass

  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A number that a path can name.
struct InstrumentNumber {
  std::string path;  ///< "sensors/encoder/delay"
  double* value;     ///< points into the instruments
  NumberKind kind;
  bool moves_time = false;  ///< it changes the observed time of the run
};

/// Delay, gain, bias of each sensor; scale, rotation, origin/x, origin/y of each camera; rate,
/// offset of each clock.
std::vector<InstrumentNumber> EnumerateNumbers(Instruments* instruments);

/// t, in s of the run, of the value recorded at τ.
double RunTime(const Instruments& instruments, const Channel& channel, double recorded);

}  // namespace tangible
