// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Recordings of real pendulums, made into observations (observation.h).
//
//   ibm_double_pendulum  no header, a row a frame: pivot, joint and tip marker, of each the
//                        vertical (down positive) and the horizontal coordinate in fifths of a
//                        pixel. Points `joint` and `tip` come out, x right, y up, in m, relative
//                        to the pivot's marker in the same frame: the camera shakes by several
//                        pixels, and what all markers share is not motion of the pendulum. (Were
//                        it the pivot that moves, its acceleration would drive the links; with
//                        that force the fit is worse.)
//   multiarm_single      columns t, th1, om1: time, absolute angle (0 upright, pi hanging), rate.
//                        Body `pendulum` comes out, its angle measured from hanging.
//
// The noise of a series is estimated from its fourth differences, in which a smooth motion leaves
// almost nothing:  d = x_{k+4} − 4 x_{k+3} + 6 x_{k+2} − 4 x_{k+1} + x_k,  var d = 70 σ².

#include <string>
#include <vector>

namespace tangible {

enum class RecordingKind { kIbmDoublePendulum, kMultiarmSingle };

inline constexpr std::pair<const char*, RecordingKind> kRecordingKindNames[] = {
    {"ibm_double_pendulum", RecordingKind::kIbmDoublePendulum},
    {"multiarm_single", RecordingKind::kMultiarmSingle}};

struct RecordingOptions {
  RecordingKind kind = RecordingKind::kIbmDoublePendulum;
  double from = 0.0;            ///< s; times count from here
  double to = 0.5;              ///< s, included
  double rate = 400.0;          ///< Hz, of a recording without times
  double first_length = 0.091;  ///< m: pivot to joint, which sets the scale of an image
};

/// One measured coordinate over all times; of equal length.
struct RecordedSeries {
  std::string target;          ///< body or point
  std::string coordinate;      ///< "x", "y" or "angle"
  std::vector<double> values;  ///< m or rad
  double noise = 0.0;          ///< standard deviation, m or rad
};

struct Recording {
  std::string target_column;  ///< "body" or "point"
  std::vector<double> times;  ///< s
  std::vector<RecordedSeries> series;
  double noise = 0.0;             ///< root mean square over the series, m or rad
  double metres_per_pixel = 0.0;  ///< 0 for angles
  double length_ratio = 0.0;      ///< mean pivot to joint over mean joint to tip; 0 for angles
};

/// σ of a series from its fourth differences; NaN with fewer than five values.
double NoiseFromFourthDifferences(const std::vector<double>& values);

/// Reads a recording from text. On failure sets one line "file: line 3: what, expected, got".
bool ParseRecording(const std::string& text, const std::string& file,
                    const RecordingOptions& options, Recording* recording, std::string* error);

/// Reads a recording from a file.
bool ReadRecording(const std::string& file, const RecordingOptions& options, Recording* recording,
                   std::string* error);

/// The observations as a table: time, target, coordinates.
std::string ObservationCsv(const Recording& recording);

}  // namespace tangible
