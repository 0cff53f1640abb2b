// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Observations: measured coordinates of bodies, or of points fixed in them.
//
// A file is a table (csv.h) with the columns `time` (s), `body` or `point` (a name), and any of
// `x`, `y` (m), `angle` (rad), `vx`, `vy` (m/s), `omega` (rad/s) and `distance` (m, to the body or
// point that the column `relative_to` or the options name). A missing row or an empty cell is a
// coordinate that was not measured. Times need not fall on steps nor be sorted; a coordinate may
// be measured more than once. The angle and its rates of a point are those of its body. A relative
// coordinate is the difference to the other body or point, in the world's directions. Accelerations
// `ax`, `ay` (m/s²), `alpha` (rad/s²) are measured by what sits there (acceleration.h), without a
// camera or reference. With a column `joint` the coordinates are `fx`, `fy` (N) and `torque` (N m),
// the force of bodies[1] on bodies[0] and its torque about the anchor; with a column `contact`
// ("a:b") `normal` and `tangent` (N, on the first body along t): force_rows.h. A file of events has
// columns `time`, `event` (a name), `number` (from 1).

#include <string>
#include <vector>

#include "tangible/estimation/problem/instruments.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// The time of an event comes after the coordinates, which are columns of a file.
enum class Coordinate {
  kX,
  kY,
  kAngle,
  kVx,
  kVy,
  kOmega,
  kDistance,
  kAx,
  kAy,
  kAlpha,
  kFx,
  kFy,
  kTorque,
  kNormal,
  kTangent,
  kTime
};
inline constexpr int kCoordinates = 15;
/// The first of these are coordinates of bodies and points.
inline constexpr int kBodyCoordinates = 10;

/// "x", "y", "angle", "vx", "vy", "omega", "distance", "ax", "ay", "alpha", "fx", "fy", "torque",
/// "normal", "tangent", "time".
const char* NameOf(Coordinate coordinate);

inline bool IsAcceleration(Coordinate coordinate) {
  return coordinate == Coordinate::kAx || coordinate == Coordinate::kAy ||
         coordinate == Coordinate::kAlpha;
}

/// Of a joint or a contact.
inline bool IsForce(Coordinate coordinate) {
  return coordinate >= Coordinate::kFx && coordinate <= Coordinate::kTangent;
}

/// A point fixed in a body: r = position + R(angle) at.
struct BodyPoint {
  std::string name;
  int body = -1;                 ///< index into the scene's bodies
  Vector2<double> at{0.0, 0.0};  ///< m, body frame
};

/// One measured coordinate.
struct Observation {
  double time = 0.0;  ///< s, by the recording's clock; without one: in the run
  int body = -1;      ///< −1: of a force
  int point = -1;     ///< index into the points; −1: the body's centre of mass
  Coordinate coordinate = Coordinate::kX;
  double value = 0.0;      ///< m, rad, m/s or rad/s; through a camera lengths are in its units
  double sigma = 1.0;      ///< the same: standard deviation of its noise
  int channel = 0;         ///< index into the channels
  int event = -1;          ///< index into the instruments' events; −1: a coordinate is measured
  int number = 1;          ///< of the event in the run, from 1
  int joint = -1;          ///< of a force: index into the scene's joints; −1: of a contact
  int pair[2] = {-1, -1};  ///< of a contact's force: its bodies
};

/// Observations of the same coordinate of the same body or point by the same channel.
struct ObservationSeries {
  std::vector<int> of;     ///< the series of each observation, from 0 in the order of appearance
  std::vector<int> first;  ///< the first observation of each series

  int size() const { return static_cast<int>(first.size()); }
};

ObservationSeries IndexSeries(const std::vector<Observation>& observations);

/// Standard deviations by coordinate, > 0; NaN: the coordinate may not be measured.
struct ObservationSigma {
  double x = 1.0;                   ///< m
  double y = 1.0;                   ///< m
  double angle = 1.0;               ///< rad
  double vx = 1.0;                  ///< m/s
  double vy = 1.0;                  ///< m/s
  double omega = 1.0;               ///< rad/s
  double distance = 1.0;            ///< m
  double ax = 1.0;                  ///< m/s²
  double ay = 1.0;                  ///< m/s²
  double alpha = 1.0;               ///< rad/s²
  double fx = 1.0;                  ///< N
  double fy = 1.0;                  ///< N
  double torque = 1.0;              ///< N m
  double normal = 1.0;              ///< N
  double tangent = 1.0;             ///< N
  std::vector<double> events = {};  ///< s, one for each of the instruments' events

  double Of(Coordinate coordinate) const;
  double OfEvent(int event) const;
};

/// How the rows of a file were made.
struct ObservationOptions {
  Channel channel;  ///< its relative_to is that of rows whose own is empty
  /// Whether angles jump by whole turns where they leave a range, and have to be made continuous:
  /// each becomes the one nearest to the extrapolation of up to ten earlier ones at their mean
  /// rate.
  bool unwrap = false;
};

/// A body or point by name.
struct BodyOrPoint {
  int body = -1;
  int point = -1;
};

/// The point with this name, or else the body; body −1 if there is none.
BodyOrPoint FindTarget(const Scene& scene, const std::vector<BodyPoint>& points,
                       const std::string& name);

/// The names of all points, for a message; "none" where there are none.
std::string PointNames(const std::vector<BodyPoint>& points);
std::string BodyNames(const Scene& scene);

/// The name of the body or point to which it is relative; empty: the world.
std::string ReferenceName(const Scene& scene, const std::vector<BodyPoint>& points,
                          const Channel& channel);

/// "m", "rad", "m/s", "rad/s", "m/s^2", "rad/s^2", "N", "N m" or "s".
const char* UnitOf(Coordinate coordinate);

/// The scene, points and instruments to which observations refer.
struct ObservedScene {
  const Scene& scene;
  const std::vector<BodyPoint>& points;
  const Instruments& instruments;
};

/// The name of the observed point, body, joint, contact ("a:b") or event.
std::string TargetName(const ObservedScene& scene, const Observation& observation);

/// False, with one line about it, where a recorded time is outside of the run; a time that the run
/// misses by rounding is moved into it.
bool CheckTime(const ObservedScene& scene, const Channel& channel, double* time, std::string* what);

/// The index of a channel, which is added where it is new.
int FindOrAdd(const Channel& channel, std::vector<Channel>* channels);

/// Reads a file and appends to `observations` and, a new one for each reference, to `channels`. On
/// failure sets one line "file: line 3: what, expected, got": a name that the scene or the points
/// do not have, a time outside the run, no measured coordinate at all. Of an event the numbers have
/// to increase.
bool ReadObservations(const std::string& file, const ObservedScene& scene,
                      const ObservationSigma& sigma, const ObservationOptions& options,
                      std::vector<Channel>* channels, std::vector<Observation>* observations,
                      std::string* error);

/// The same from text.
bool ParseObservations(const std::string& text, const std::string& file, const ObservedScene& scene,
                       const ObservationSigma& sigma, const ObservationOptions& options,
                       std::vector<Channel>* channels, std::vector<Observation>* observations,
                       std::string* error);

/// Observations without instruments, relative to the world.
bool ParseObservations(const std::string& text, const std::string& file, const Scene& scene,
                       const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                       std::vector<Observation>* observations, std::string* error);

}  // namespace tangible
