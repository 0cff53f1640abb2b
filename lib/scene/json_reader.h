// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Reading JSON files with errors that name the place.
//
// Every error is one line "file: /json/pointer: what, expected, got", or, when the text is not
// JSON, "file: line 3, column 7: what". A reader never throws. The first error of a document is
// kept, and reading goes on with defaults, so that callers check once, at the end:
//
//   Json json;
//   if (!ParseJsonFile(file, &json, error)) return false;
//   JsonErrors errors(file);
//   const JsonReader root(json, &errors);
//   root.ExpectKeys({"name", "mass"});
//   const double mass = root.At("mass").Number(NumberKind::kPositive);
//   if (!errors.ok()) { *error = errors.message(); return false; }

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/scene/number_kind.h"
#include "tangible/scene/text_file.h"

namespace tangible {

using Json = nlohmann::json;

/// Objects and arrays may be nested this deep; deeper ones are refused.
inline constexpr int kMaxJsonDepth = 64;

/// Parses text. Refused: malformed text (line and column), numbers that a double cannot hold
/// (1e999), NaN and Infinity, a key twice in one object, nesting beyond kMaxJsonDepth, text after
/// the value.
bool ParseJson(const std::string& text, const std::string& name_for_messages, Json* json,
               std::string* error);

/// ReadTextFile, then ParseJson.
bool ParseJsonFile(const std::string& file, Json* json, std::string* error);

/// A value for a message, at most about 60 characters: a number, a string in quotes, "an array of
/// 3".
std::string Describe(const Json& value);

/// The first error of one document.
class JsonErrors {
 public:
  explicit JsonErrors(std::string file) : file_(std::move(file)) {}
  bool ok() const { return message_.empty(); }
  /// One line, or empty.
  const std::string& message() const { return message_; }
  const std::string& file() const { return file_; }
  /// Keeps "file: pointer: what" unless there is an error already; an empty pointer is the whole
  /// file.
  void Add(const std::string& pointer, const std::string& what);

 private:
  std::string file_;
  std::string message_;
};

/// A value of a document (or its absence) and its place. Cheap to copy; the document must outlive
/// it.
class JsonReader {
 public:
  /// The whole document.
  JsonReader(const Json& root, JsonErrors* errors) : value_(&root), errors_(errors) {}

  /// Of no document: the places of values in memory, for messages on them.
  static JsonReader Nothing(JsonErrors* errors) { return JsonReader(nullptr, "", errors); }

  bool ok() const { return errors_->ok(); }
  const std::string& pointer() const { return pointer_; }
  /// Whether the value is there at all.
  bool exists() const { return value_ != nullptr; }
  bool IsObject() const { return value_ != nullptr && value_->is_object(); }
  bool IsArray() const { return value_ != nullptr && value_->is_array(); }
  bool IsString() const { return value_ != nullptr && value_->is_string(); }
  bool IsNull() const { return value_ != nullptr && value_->is_null(); }
  bool IsNumber() const { return value_ != nullptr && value_->is_number(); }
  bool Is(const Json& value) const { return value_ != nullptr && *value_ == value; }

  /// Records "file: pointer: what".
  void Fail(const std::string& what) const { errors_->Add(pointer_, what); }
  /// Records "file: pointer: expected X, got Y", or "missing, expected X" if it does not exist.
  void FailExpected(const std::string& expected) const;
  /// The same of a number that may be in memory alone.
  void FailExpected(const std::string& expected, double number) const;

  /// Whether this is an object with that key.
  bool Has(const std::string& key) const;
  /// The member of an object; if there is none, a reader of nothing, which fails when it is read.
  JsonReader At(const std::string& key) const;
  /// The element of an array, in the same way.
  JsonReader At(int index) const;
  /// Elements of an array; 0 for anything else.
  int Size() const;
  /// The keys of an object, sorted; empty for anything else.
  std::vector<std::string> Keys() const;

  /// Fails unless this is an object whose keys are all among these. `where` ends the message on an
  /// unknown key, e.g. " of a weld joint". The message does not name `withdrawn`, which pass.
  void ExpectKeys(const std::vector<std::string>& keys, const std::string& where = "",
                  const std::vector<std::string>& withdrawn = {}) const;
  /// Fails unless this is an array; returns its size.
  int ExpectArray(const std::string& expected) const;

  /// The value, which must have that type; on failure records it and returns 0, false, "" or empty.
  double Number(NumberKind kind = NumberKind::kFree) const;
  int Integer(int low, int high) const;
  bool Boolean() const;
  std::string String() const;
  /// [x, y].
  Vector2<double> Point() const;
  /// An array of numbers.
  VectorX<double> Vector() const;
  /// An array of rows of equal length; [] is 0 × 0.
  MatrixX<double> Matrix() const;
  /// A string that must be one of the names; returns its index, 0 on failure.
  int Choice(const std::vector<std::string>& names) const;
  /// The same for a table of names and enumerators.
  template <typename Enum, std::size_t N>
  Enum Choice(const std::pair<const char*, Enum> (&table)[N]) const {
    std::vector<std::string> names;
    for (const auto& entry : table) names.emplace_back(entry.first);
    return table[Choice(names)].second;
  }

 private:
  JsonReader(const Json* value, std::string pointer, JsonErrors* errors)
      : value_(value), pointer_(std::move(pointer)), errors_(errors) {}

  const Json* value_;
  std::string pointer_;
  JsonErrors* errors_;
};

}  // namespace tangible
