// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Recordings in the formats of other programs, converted to observation files (observation.h).
//
//   table        any table, wide (a column a coordinate) or long (a row a body or point), with a
//                mapping that says which columns are what:
//                  {"time": "t",
//                   "columns": [{"column": "th1", "body": "arm", "coordinate": "angle",
//                                "scale": 0.0174532925, "offset": 0, "relative_to": "base"}]}
//                or, long, with the column that has the names, and what they are called here:
//                  {"time": {"column": "ms", "scale": 0.001}, "target": "point", "name": "marker",
//                   "names": {"LED 1": "tip"}, "columns": [{"column": "X", "coordinate": "x"}]}
//                A coordinate is scale · cell + offset. Names that `names` leaves out are left out;
//                without it all are taken. Without `time` rows are frames. What is observed may
//                also be a `joint` or a `contact` ("a:b"), with the coordinates of their forces.
//                Times of events are those of the rows of a table of one kind of event,
//                  {"time": "t", "event": "bounce"}
//                or of several, {"time": "t", "target": "event", "name": "what"}; each counts from
//                1 in the part that is read, or has its number in the column `number`.
//   deeplabcut   three header rows (scorer, bodyparts, coords), or four with several animals
//                (individuals); the first column is the frame. Points are named by their body part,
//                or ANIMAL.PART. Cells below the likelihood wanted are missing data.
//   tracker      Tracker's data files: the track's name, then the names of columns, or after a line
//                `#multi:` the names of several tracks above their columns. Points are named by
//                their track; x, y, vx and vy are taken, in the units of Tracker's calibration.
//
// Cells are separated by tabs, semicolons or commas, whichever the header has first in this order;
// with the first two a decimal comma is one. Characters that a name may not have become _.

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"

namespace tangible {

enum class TableFormat { kTable, kDeepLabCut, kTracker };

inline constexpr std::pair<const char*, TableFormat> kTableFormatNames[] = {
    {"table", TableFormat::kTable},
    {"deeplabcut", TableFormat::kDeepLabCut},
    {"tracker", TableFormat::kTracker}};

struct TableOptions {
  TableFormat format = TableFormat::kTable;
  std::string mapping;       ///< of kTable: JSON text
  std::string mapping_file;  ///< for messages
  /// s: rows before are left out, and times count from here. Without it rows before 0 are left out,
  /// and times count from 0, or from the first row where that is one of a clock (kClockTime).
  std::optional<double> from{};
  double to = std::numeric_limits<double>::infinity();  ///< s, included
  double frame_rate = 0.0;  ///< Hz, where the file has no times; 0: it must have them
  double likelihood = 0.0;  ///< from 0 to 1: points below are missing data
  double scale = 1.0;       ///< m a unit of length of the file
  bool y_down = false;      ///< y, and with it angles, are counted downwards: they change sign
};

/// The measurements of a body, point, joint or contact at one time (NaN: missing), or an event.
struct TableRow {
  double time = 0.0;  ///< s
  std::string name;
  std::string relative_to;  ///< empty: the world
  std::array<double, kCoordinates> values;
  long number = 0;  ///< of an event: 1 is the first
};

struct TableRecording {
  std::string target_column;  ///< "body", "point", "joint", "contact" or "event"
  std::vector<TableRow> rows;
  double start = 0.0;  ///< s of the file: from here times count where they were those of a clock
  /// The standard deviation of the noise of each series, by fourth differences (recording.h).
  struct Noise {
    std::string name;
    Coordinate coordinate;
    double value;
  };
  std::vector<Noise> noise;
  long before_zero = 0;  ///< rows that were left out, as their time is before 0
  long missing = 0;      ///< cells that were empty or not likely enough
};

/// Reads a recording from text. On failure sets one line "file: line 3: what, expected, got": an
/// unknown column, times that run backwards, a scale of 0 or one that overflows, a likelihood
/// outside [0, 1], no row in the window.
bool ParseTableRecording(const std::string& text, const std::string& file,
                         const TableOptions& options, TableRecording* recording,
                         std::string* error);

/// The observations as a file; its numbers read back to the same doubles.
std::string ObservationCsv(const TableRecording& recording);

}  // namespace tangible
