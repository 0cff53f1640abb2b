// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rows of a run in a shard's file (shards.h) and back, bit for bit: numbers that are not finite are
// the texts "nan", "inf" and "-inf", which JSON has no numbers for.
//
// A struct says its fields once, for both directions, in a function beside it:
//
//   template <typename Visitor>
//   void VisitFields(Outcome& outcome, const Visitor& visit) {
//     visit("distance", outcome.distance);
//     ...
//   }

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "tangible/scene/json_reader.h"

namespace tangible {

namespace row_archive {

template <typename T>
struct IsVector : std::false_type {};
template <typename T>
struct IsVector<std::vector<T>> : std::true_type {};
template <typename T>
struct IsOptional : std::false_type {};
template <typename T>
struct IsOptional<std::optional<T>> : std::true_type {};
template <typename T>
struct IsMap : std::false_type {};
template <typename T>
struct IsMap<std::map<std::string, T>> : std::true_type {};
template <typename T>
inline constexpr bool kIsMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;
/// Numbers that JSON holds exactly, and texts.
template <typename T>
inline constexpr bool kIsPlain = std::is_integral_v<T> || std::is_same_v<T, std::string>;

inline Json Number(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0.0 ? "inf" : "-inf";
}

inline double ReadNumber(const Json& json) {
  if (json == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (json == "inf") return std::numeric_limits<double>::infinity();
  return json == "-inf" ? -std::numeric_limits<double>::infinity() : json.get<double>();
}

}  // namespace row_archive

/// A value with all that it holds.
template <typename T>
Json ToRow(const T& value) {
  using namespace row_archive;
  if constexpr (std::is_same_v<T, double>) {
    return Number(value);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<int>(value);
  } else if constexpr (kIsPlain<T>) {
    return value;
  } else if constexpr (IsVector<T>::value || std::is_array_v<T>) {
    Json array = Json::array();
    for (const auto& item : value) array.push_back(ToRow(item));
    return array;
  } else if constexpr (IsOptional<T>::value) {
    return value ? Json::array({ToRow(*value)}) : Json::array();
  } else if constexpr (IsMap<T>::value) {
    Json object = Json::object();
    for (const auto& [key, item] : value) object[key] = ToRow(item);
    return object;
  } else if constexpr (kIsMatrix<T>) {
    Json array = Json::array({value.rows(), value.cols()});
    for (Eigen::Index i = 0; i < value.size(); ++i) array.push_back(Number(value.data()[i]));
    return array;
  } else {
    Json object = Json::object();
    // Both directions visit the same fields; this one changes none.
    VisitFields(const_cast<T&>(value),
                [&object](const char* name, const auto& field) { object[name] = ToRow(field); });
    return object;
  }
}

/// The same back; throws Json::exception where the row holds something else.
template <typename T>
void FromRow(const Json& json, T* value) {
  using namespace row_archive;
  if constexpr (std::is_same_v<T, double>) {
    *value = ReadNumber(json);
  } else if constexpr (std::is_enum_v<T>) {
    *value = static_cast<T>(json.get<int>());
  } else if constexpr (kIsPlain<T>) {
    *value = json.get<T>();
  } else if constexpr (IsVector<T>::value) {
    value->clear();
    for (const Json& item : json) FromRow(item, &value->emplace_back());
  } else if constexpr (std::is_array_v<T>) {
    for (std::size_t i = 0; i < std::extent_v<T>; ++i) FromRow(json.at(i), &(*value)[i]);
  } else if constexpr (IsOptional<T>::value) {
    value->reset();
    if (!json.empty()) FromRow(json.at(0), &value->emplace());
  } else if constexpr (IsMap<T>::value) {
    value->clear();
    for (const auto& item : json.items()) FromRow(item.value(), &(*value)[item.key()]);
  } else if constexpr (kIsMatrix<T>) {
    value->resize(json.at(0).get<Eigen::Index>(), json.at(1).get<Eigen::Index>());
    for (Eigen::Index i = 0; i < value->size(); ++i) {
      value->data()[i] = ReadNumber(json.at(static_cast<std::size_t>(i) + 2));
    }
  } else {
    VisitFields(*value, [&json](const char* name, auto& field) { FromRow(json.at(name), &field); });
  }
}

/// Each row as ToRow has it.
template <typename T>
std::vector<Json> ToRows(const std::vector<T>& values) {
  std::vector<Json> rows;
  rows.reserve(values.size());
  for (const T& value : values) rows.push_back(ToRow(value));
  return rows;
}

/// The rows of all shards; false with one line where they hold something else.
template <typename T>
bool FromRows(const std::vector<Json>& rows, std::vector<T>* values, std::string* error) {
  try {
    for (const Json& row : rows) FromRow(row, &values->emplace_back());
  } catch (const Json::exception&) {
    *error = "--merge: expected the rows of this program, got others";
    return false;
  }
  return true;
}

}  // namespace tangible
