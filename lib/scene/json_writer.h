// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// JSON as readable text: keys in the order given, an indentation of two spaces for each level;
// arrays or objects that hold no further ones, and points in arrays, are on one line.

#include <nlohmann/json.hpp>
#include <string>

namespace tangible {

using OrderedJson = nlohmann::ordered_json;

/// Numbers as the shortest text that reads back bit for bit; those that are not finite as null.
/// Ends with a line break.
std::string JsonText(const OrderedJson& json);

}  // namespace tangible
