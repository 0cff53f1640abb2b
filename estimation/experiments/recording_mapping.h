// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which columns of a table are what: found in the headers of known formats, or said by a mapping
// (recording_table.h).

#include <map>
#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"

namespace tangible {

/// One column of a file.
struct ValueColumn {
  int column = -1;
  std::string name;  ///< of what is observed; empty: the row says it
  std::string relative_to;
  Coordinate coordinate = Coordinate::kX;
  double scale = 1.0;
  double offset = 0.0;
  int likelihood = -1;  ///< its column, −1: none
};

/// The layout of a file: the meaning of its columns.
struct Layout {
  std::string target_column = "point";  ///< "body", "point", "joint", "contact" or "event"
  int time = -1;                        ///< −1: rows are frames
  double time_scale = 1.0;
  double time_offset = 0.0;
  int frame = -1;  ///< column of the frame's number; −1: the row's
  int name = -1;
  std::string event;  ///< of all rows, where the mapping names it
  int number = -1;    ///< column of the number of an event; −1: rows are counted from 1
  std::map<std::string, std::string> names;  ///< empty: all as they are
  std::vector<ValueColumn> values;
};

/// The name with the characters that observation files and paths allow, and those of `extra`.
std::string CleanedName(const std::string& name, const std::string& extra = "");

/// The layout of a table that the mapping `root` describes; its mistakes are those of `root`.
void ReadMapping(const JsonReader& root, const CsvTable& table, Layout* layout);

}  // namespace tangible
