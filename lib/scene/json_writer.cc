// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/json_writer.h"

#include <cstddef>

namespace tangible {
namespace {

// Lists longer than this have a line for each entry.
constexpr std::size_t kLineLength = 100;

std::string Scalar(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

// On one line: {"a": 1, "b": [2, 3]}.
std::string Flat(const OrderedJson& json) {
  if (!json.is_structured()) return Scalar(json);
  std::string text;
  for (const auto& item : json.items()) {
    if (!text.empty()) text += ", ";
    if (json.is_object()) text += Scalar(item.key()) + ": ";
    text += Flat(item.value());
  }
  return json.is_object() ? "{" + text + "}" : "[" + text + "]";
}

void Write(const OrderedJson& json, std::size_t indent, std::string* text) {
  const std::string flat = Flat(json);
  if (!json.is_structured() || indent + flat.size() <= kLineLength) {
    *text += flat;
    return;
  }
  *text += json.is_object() ? '{' : '[';
  const std::string blanks(indent + 2, ' ');
  bool first = true;
  for (const auto& item : json.items()) {
    *text += first ? "\n" : ",\n";
    first = false;
    *text += blanks;
    if (json.is_object()) *text += Scalar(item.key()) + ": ";
    Write(item.value(), indent + 2, text);
  }
  *text += '\n' + blanks.substr(2);
  *text += json.is_object() ? '}' : ']';
}

}  // namespace

std::string JsonText(const OrderedJson& json) {
  std::string text;
  Write(json, 0, &text);
  return text + "\n";
}

}  // namespace tangible
