// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// JSON as text that people read: keys in the order given, two spaces a level, and arrays or objects
// that hold no further ones, and points in arrays, on one line.

#include <nlohmann/json.hpp>
#include <string>

namespace tangible {

using OrderedJson = nlohmann::ordered_json;

/// Numbers as the shortest text that reads back bit for bit; those that are not finite as null.
/// Ends with a line break.
std::string JsonText(const OrderedJson& json);

}  // namespace tangible
