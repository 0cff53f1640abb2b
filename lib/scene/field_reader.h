// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The visitor that reads the fields of an item (scene_fields.h) from a scene file.

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/signal.h"

namespace tangible {

/// Reads the path of a body from the object that holds it.
using PathReader = std::function<std::shared_ptr<const RecordedPath>(const JsonReader&)>;

/// Reads a signal that a field names by {"file": ...}.
using SignalReader = std::function<Signal(const JsonReader&, SignalColumns)>;

/// Absent keys leave the default.
class FieldReader {
 public:
  explicit FieldReader(const JsonReader& item, SignalReader signal = nullptr,
                       PathReader path = nullptr)
      : item_(item), signal_(std::move(signal)), path_(std::move(path)) {}

  void Number(const Field& field, double& value) {
    if (IsRead(field)) value = item_.At(field.key).Number(field.kind);
  }
  void Optional(const Field& field, std::optional<double>& value) {
    if (IsRead(field)) value = item_.At(field.key).Number(field.kind);
  }
  void Point(const Field& field, Vector2<double>& value) {
    if (IsRead(field)) value = item_.At(field.key).Point();
  }
  void Points(const Field& field, std::vector<Vector2<double>>& values) {
    if (!IsRead(field)) return;
    const JsonReader points = item_.At(field.key);
    const int size = points.ExpectArray("an array of points [x, y]");
    for (int i = 0; i < size; ++i) values.push_back(points.At(i).Point());
  }
  void List(const Field& field, std::vector<double>& values) {
    if (!IsRead(field)) return;
    const JsonReader list = item_.At(field.key);
    const int size = list.ExpectArray("an array of numbers");
    for (int i = 0; i < size; ++i) values.push_back(list.At(i).Number(field.kind));
  }
  void Anchors(const Field& field, Vector2<double> (&anchors)[2]) {
    const JsonReader reader = item_.At(field.key);
    if (reader.Size() != 2) return reader.FailExpected("an array of 2 points [[x, y], [x, y]]");
    for (int i = 0; i < 2; ++i) anchors[i] = reader.At(i).Point();
  }
  void Interval(const Field& field, std::optional<std::pair<double, double>>& value) {
    if (!IsRead(field)) return;
    const JsonReader reader = item_.At(field.key);
    if (reader.Size() != 2) return reader.FailExpected("an array of 2 numbers [low, high]");
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const auto bound = [&](int i, double none) {
      return reader.At(i).IsNull() ? none : reader.At(i).Number(field.kind);
    };
    value = {bound(0, -kInfinity), bound(1, kInfinity)};
    if (reader.At(0).IsNull() && reader.At(1).IsNull()) {
      reader.Fail("expected a number at one side at least, got [null, null]");
    }
  }
  void Numbers(const Field& field, double& first, double& second) {
    const JsonReader reader = item_.At(field.key);
    if (reader.Size() != 2) {
      const char* const range = field.kind == NumberKind::kPositive ? " > 0" : "";
      return reader.FailExpected(std::string("an array of 2 numbers") + range + field.form);
    }
    first = reader.At(0).Number(field.kind);
    second = reader.At(1).Number(field.kind);
  }
  void Vertices(const Field& field, std::vector<double>& numbers) {
    const JsonReader vertices = item_.At(field.key);
    const int size = vertices.Size();
    if (size < field.least) {
      return vertices.FailExpected("an array of at least " + std::to_string(field.least) +
                                   " points");
    }
    for (int i = 0; i < size; ++i) {
      const Vector2<double> vertex = vertices.At(i).Point();
      numbers.insert(numbers.end(), {vertex.x(), vertex.y()});
    }
  }
  void NumberOrSignal(const Field& field, double& value, std::optional<Signal>& signal) {
    if (!IsRead(field)) return;
    const JsonReader reader = item_.At(field.key);
    if (reader.IsObject()) {
      signal = signal_(reader, SignalColumns::kValue);
    } else if (reader.IsNumber()) {
      value = reader.Number(field.kind);
    } else {
      reader.FailExpected("a number or {\"file\": ...}");
    }
  }
  void PointOrSignal(const Field& field, Vector2<double>& value, std::optional<Signal>& signal) {
    if (!IsRead(field)) return;
    const JsonReader reader = item_.At(field.key);
    if (reader.IsObject()) {
      signal = signal_(reader, SignalColumns::kForce);
    } else if (reader.IsArray()) {
      value = reader.Point();
    } else {
      reader.FailExpected("[x, y] or {\"file\": ...}");
    }
  }
  template <typename Servo>
  void NumberOrServo(const Field& field, double& value, std::optional<Signal>& signal,
                     std::optional<Servo>& servo, const ServoFields& visit) {
    if (!IsRead(field)) return;
    const JsonReader reader = item_.At(field.key);
    if (IsServo(reader)) return ReadPart(reader, " of a servo", servo, visit);
    if (!reader.IsObject() && !reader.IsNumber()) return reader.FailExpected(kNumberOrObject);
    NumberOrSignal(field, value, signal);
  }
  template <typename Servo>
  void PointOrServos(const Field& field, Vector2<double>& value, std::optional<Signal>& signal,
                     std::optional<Servo> (&servos)[2], const ServoFields& visit) {
    if (!IsRead(field)) return;
    const JsonReader reader = item_.At(field.key);
    if (!reader.IsArray()) return PointOrSignal(field, value, signal);
    if (!reader.At(0).IsObject() && !reader.At(1).IsObject()) {
      value = reader.Point();
      return;
    }
    if (reader.Size() != 2) return reader.FailExpected("[x, y], each a number or a servo");
    for (int i = 0; i < 2; ++i) {
      if (reader.At(i).IsObject()) {
        ReadPart(reader.At(i), " of a servo", servos[i], visit);
      } else {
        value[i] = reader.At(i).Number(field.kind);
      }
    }
  }
  template <typename Item, typename Visit>
  void Part(const Field& field, std::optional<Item>& value, const Visit& visit) {
    if (!IsRead(field)) return;
    ReadPart(item_.At(field.key), std::string(" of a ") + field.key, value, visit);
  }
  void Path(std::shared_ptr<const RecordedPath>& path) { path = path_(item_); }
  /// `Value` is the enumeration, or an optional of it, which an absent key leaves empty.
  template <typename Enum, std::size_t N, typename Value>
  void Choice(const char* key, const std::pair<const char*, Enum> (&table)[N], Value& value) {
    if (item_.Has(key)) value = item_.At(key).Choice(table);
  }
  void Flag(const char* key, bool& value) {
    if (item_.Has(key)) value = item_.At(key).Boolean();
  }
  void Count(const char* key, int low, int high, int& value) {
    if (item_.Has(key)) value = item_.At(key).Integer(low, high);
  }

 private:
  static constexpr char kNumberOrObject[] = "a number, {\"file\": ...} or {\"target\": ...}";

  static bool IsServo(const JsonReader& reader) {
    return reader.IsObject() && (reader.Has("target") || reader.Has("stiffness") ||
                                 reader.Has("damping") || reader.Has("limit"));
  }

  template <typename Item, typename Visit>
  void ReadPart(const JsonReader& part, const std::string& of, std::optional<Item>& value,
                const Visit& visit) {
    value.emplace();
    FieldKeys keys;
    visit(*value, &keys);
    part.ExpectKeys(keys.keys(), of);
    if (!part.ok()) return;
    FieldReader reader(part, signal_, path_);
    visit(*value, &reader);
  }

  bool IsRead(const Field& field) const {
    const bool written = item_.Has(field.key);
    if (!field.present && written && field.without != nullptr) {
      item_.At(field.key).Fail(std::string("expected no ") + field.key + " beside " +
                               field.without + ", which gives it");
    } else if (!field.present && written) {
      item_.At(field.with)
          .Fail(std::string("missing, expected ") + field.with_form + " with " + field.key);
    }
    return field.present && (written || field.required);
  }

  const JsonReader& item_;
  SignalReader signal_;
  PathReader path_;
};

}  // namespace tangible
