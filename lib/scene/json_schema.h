// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Parts of JSON Schemas (draft 2020-12, https://json-schema.org/draft/2020-12/schema), from which
// editors complete keys and mark mistakes. What concerns several values of a file, or other files,
// is checked by the readers alone.

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/scene/number_kind.h"

namespace tangible {

/// A number in the range of `kind`. `unit` is what an editor shows, "m".
OrderedJson SchemaOfNumber(NumberKind kind, const std::string& unit = "");
OrderedJson SchemaOfInteger(int least, int most);
/// At most so many items; 0: any number.
OrderedJson SchemaOfArray(OrderedJson items, int least, int most = 0);
/// No other keys than those of `properties`.
OrderedJson SchemaOfObject(OrderedJson properties, const std::vector<std::string>& required);
/// An object whose keys are names.
OrderedJson SchemaByName(OrderedJson item);
/// Letters, digits, `_ . -` and the characters of `also`.
OrderedJson SchemaOfName(const std::string& also = "");
inline OrderedJson SchemaOfText() { return {{"type", "string"}}; }
inline OrderedJson SchemaOfFlag() { return {{"type", "boolean"}}; }
/// One of some words.
OrderedJson SchemaOfWords(const std::vector<std::string>& words);
/// The words of a table of names and enumerators.
template <typename Enum, std::size_t N>
std::vector<std::string> WordsOf(const std::pair<const char*, Enum> (&table)[N]) {
  std::vector<std::string> words;
  for (const auto& entry : table) words.emplace_back(entry.first);
  return words;
}
inline OrderedJson SchemaOfNull() { return {{"type", "null"}}; }
/// One of several.
OrderedJson SchemaOfAny(std::initializer_list<OrderedJson> schemas);
/// [x, y]
OrderedJson SchemaOfPoint(const std::string& unit);
/// A whole file: "a scene".
OrderedJson SchemaOfFile(const std::string& title, const OrderedJson& schema);

}  // namespace tangible
