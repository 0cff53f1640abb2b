// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Observations: coordinates of bodies, or of points fixed in them, that somebody measured.
//
// A file is a table (csv.h) with the columns `time` (s), `body` or `point` (a name), and any of
// `x`, `y` (m) and `angle` (rad). A missing row or an empty cell is a coordinate that was not
// measured. Times need not fall on steps nor be sorted; a coordinate may be measured more than
// once. The angle of a point is that of its body.

#include <string>
#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

enum class Coordinate { kX, kY, kAngle };

/// "x", "y" or "angle".
const char* NameOf(Coordinate coordinate);

/// A point fixed in a body: r = position + R(angle) at.
struct BodyPoint {
  std::string name;
  int body = -1;                 ///< index into the scene's bodies
  Vector2<double> at{0.0, 0.0};  ///< m, body frame
};

/// One measured coordinate.
struct Observation {
  double time = 0.0;  ///< s, within the run
  int body = -1;
  int point = -1;  ///< index into the points; −1: the body's centre of mass
  Coordinate coordinate = Coordinate::kX;
  double value = 0.0;  ///< m or rad
  double sigma = 1.0;  ///< m or rad: standard deviation of its noise
  int file = 0;        ///< which of the files it is from
};

/// Observations of the same coordinate of the same body or point from the same file.
struct ObservationSeries {
  std::vector<int> of;     ///< of each observation its series, from 0 in the order of appearance
  std::vector<int> first;  ///< of each series its first observation

  int size() const { return static_cast<int>(first.size()); }
};

ObservationSeries IndexSeries(const std::vector<Observation>& observations);

/// Standard deviations by coordinate, > 0.
struct ObservationSigma {
  double x = 1.0;      ///< m
  double y = 1.0;      ///< m
  double angle = 1.0;  ///< rad
};

/// What is observed: the name of the point, or of the body.
std::string TargetName(const Scene& scene, const std::vector<BodyPoint>& points,
                       const Observation& observation);

/// "m" or "rad".
const char* UnitOf(Coordinate coordinate);

/// Reads a file and appends to `observations` with the number of the file. On failure sets one line
/// "file: line 3: what, expected, got": a name that the scene or the points do not have, a time
/// outside [0, duration], no measured coordinate at all.
bool ReadObservations(const std::string& file, const Scene& scene,
                      const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                      std::vector<Observation>* observations, std::string* error,
                      int file_number = 0);

/// The same from text.
bool ParseObservations(const std::string& text, const std::string& file, const Scene& scene,
                       const std::vector<BodyPoint>& points, const ObservationSigma& sigma,
                       std::vector<Observation>* observations, std::string* error);

}  // namespace tangible
