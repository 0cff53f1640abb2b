// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording_mapping.h"

#include <algorithm>
#include <utility>

#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

/// The name with each line break as a space, which is how CommaText leaves it in a cell.
std::string InOneLine(std::string name) {
  name.erase(std::remove(name.begin(), name.end(), '\r'), name.end());
  std::replace(name.begin(), name.end(), '\n', ' ');
  return name;
}

/// Reads a mapping for the columns of a table.
class MappingReader {
 public:
  MappingReader(const JsonReader& root, const CsvTable& table, Layout* layout)
      : root_(root), table_(table), layout_(layout) {}

  void Read() {
    root_.ExpectKeys({"time", "target", "name", "names", "columns", "event", "number"},
                     " of a mapping");
    if (root_.Has("time")) {
      ReadTime(root_.At("time"));
    }
    const bool is_long = root_.Has("name");
    if (is_long) {
      ReadNames();
    } else if (root_.Has("target") || root_.Has("names")) {
      root_.At(root_.Has("target") ? "target" : "names")
          .Fail("goes with name, the column that says whose a row is");
    }
    if (root_.Has("event") || layout_->target_column == kEvent) {
      ReadEvents(is_long);
    } else {
      ReadColumns(is_long);
    }
  }

 private:
  static constexpr const char* kEvent = "event";
  static constexpr const char* kContact = "contact";
  static constexpr const char* kJoint = "joint";
  static constexpr std::pair<const char*, const char*> kTargets[] = {{"body", "body"},
                                                                     {"point", "point"},
                                                                     {kJoint, kJoint},
                                                                     {kContact, kContact},
                                                                     {kEvent, kEvent}};

  void ReadNames() {
    layout_->name = ColumnOf(root_.At("name"));
    layout_->target_column = root_.At("target").Choice(kTargets);
    if (!root_.Has("names")) return;
    const JsonReader names = root_.At("names");
    if (!names.IsObject()) {
      names.FailExpected("an object of names");
    }
    for (const std::string& name : names.Keys()) {
      layout_->names[InOneLine(name)] = TargetAt(names.At(name), layout_->target_column);
    }
  }

  // The times of rows are those of events, so that no column has anything else.
  void ReadEvents(bool is_long) {
    layout_->target_column = kEvent;
    if (root_.Has("columns")) {
      root_.At("columns").Fail("goes not with events, whose times are those of the rows");
    }
    if (root_.Has("event")) {
      layout_->event = NameAt(root_.At("event"));
      if (is_long) root_.At("event").Fail("goes not with name, which says what a row is");
    }
    if (!root_.Has("time")) root_.Fail("expected time, the column of the events' times, got none");
    if (root_.Has("number")) layout_->number = ColumnOf(root_.At("number"));
  }

  void ReadColumns(bool is_long) {
    if (root_.Has("number")) root_.At("number").Fail("goes with events");
    const JsonReader columns = root_.At("columns");
    const int count = columns.ExpectArray("an array of {column, coordinate}");
    for (int i = 0; i < count && root_.ok(); ++i) {
      layout_->values.push_back(ReadColumn(columns.At(i), is_long));
    }
    if (count == 0) {
      columns.Fail("expected at least one column, got none");
    }
  }

  int ColumnOf(const JsonReader& json) const {
    const std::string name = json.String();
    const int column = table_.Column(InOneLine(name));
    if (column < 0 && json.IsString()) {
      std::string names;
      for (const std::string& other : table_.columns) {
        names += (names.empty() ? "" : ", ") + other;
      }
      json.FailExpected("the name of a column of " + table_.file + " (" + names + ")");
    }
    return column;
  }

  static std::string NameAt(const JsonReader& json) {
    std::string name = json.String();
    if (json.IsString() && !IsName(name)) {
      json.FailExpected("a name of letters, digits and _.-");
    }
    return name;
  }

  // A contact is named by its bodies, "a:b".
  static std::string TargetAt(const JsonReader& json, const std::string& target) {
    if (target != kContact) return NameAt(json);
    std::string name = json.String();
    const size_t colon = name.find(':');
    if (json.IsString() && (colon == std::string::npos || !IsName(name.substr(0, colon)) ||
                            !IsName(name.substr(colon + 1)))) {
      json.FailExpected("the names of two bodies as \"a:b\"");
    }
    return name;
  }

  static double ScaleAt(const JsonReader& json) {
    if (!json.Has("scale")) {
      return 1.0;
    }
    const double scale = json.At("scale").Number();
    if (scale == 0.0) {
      json.At("scale").FailExpected("a number other than 0");
    }
    return scale;
  }

  void ReadTime(const JsonReader& json) {
    if (json.IsString()) {
      layout_->time = ColumnOf(json);
      return;
    }
    json.ExpectKeys({"column", "scale", "offset"}, " of time");
    layout_->time = ColumnOf(json.At("column"));
    layout_->time_scale = json.Has("scale") ? json.At("scale").Number(NumberKind::kPositive) : 1.0;
    layout_->time_offset = json.Has("offset") ? json.At("offset").Number() : 0.0;
  }

  ValueColumn ReadColumn(const JsonReader& json, bool is_long) {
    json.ExpectKeys({"column", "coordinate", "body", "point", kJoint, kContact, "relative_to",
                     "scale", "offset"},
                    " of a column");
    ValueColumn value;
    value.column = ColumnOf(json.At("column"));
    value.scale = ScaleAt(json);
    value.offset = json.Has("offset") ? json.At("offset").Number() : 0.0;
    value.relative_to = json.Has("relative_to") ? NameAt(json.At("relative_to")) : "";
    std::string target;
    int given = 0;
    for (const char* const one : {"body", "point", kJoint, kContact}) {
      if (!json.Has(one)) continue;
      target = one;
      ++given;
    }
    if (given != (is_long ? 0 : 1)) {
      json.Fail(is_long ? "expected no body, point, joint or contact: the column of names says "
                          "whose a row is"
                        : "expected one of body, point, joint and contact, got " +
                              std::string(given == 0 ? "none" : "several"));
      return value;
    }
    if (!is_long) {
      if (!layout_->values.empty() && layout_->target_column != target) {
        json.At(target).Fail(
            "expected all columns to be of bodies, or all of points, joints or contacts: an "
            "observation file has one kind");
      }
      layout_->target_column = target;
      value.name = TargetAt(json.At(target), target);
    }
    value.coordinate = ReadCoordinate(json.At("coordinate"));
    if (IsForce(value.coordinate) && json.Has("relative_to")) {
      json.At("relative_to").Fail("goes not with forces");
    }
    return value;
  }

  Coordinate ReadCoordinate(const JsonReader& json) const {
    const std::string& target = layout_->target_column;
    const bool is_joint = target == kJoint;
    const bool is_contact = target == kContact;
    const std::string name = json.String();
    for (int i = 0; i < kCoordinates; ++i) {
      const auto one = static_cast<Coordinate>(i);
      const bool of_contact = one == Coordinate::kNormal || one == Coordinate::kTangent;
      const bool fits =
          IsForce(one) ? (of_contact ? is_contact : is_joint) : !is_joint && !is_contact;
      if (fits && name == NameOf(one)) return one;
    }
    json.FailExpected(is_joint     ? "fx, fy or torque"
                      : is_contact ? "normal or tangent"
                                   : "x, y, angle, vx, vy, omega, distance, ax, ay or alpha");
    return Coordinate::kX;
  }

  JsonReader root_;
  const CsvTable& table_;
  Layout* layout_;
};

}  // namespace

std::string CleanedName(const std::string& name, const std::string& extra) {
  std::string clean = name;
  for (char& c : clean) {
    if (!IsName(std::string(1, c), extra)) {
      c = '_';
    }
  }
  return clean;
}

void ReadMapping(const JsonReader& root, const CsvTable& table, Layout* layout) {
  MappingReader(root, table, layout).Read();
}

}  // namespace tangible
