// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Signal files: the values of a force, torque or effort over time.
//
// A table (csv.h) with the column `time` (s, strictly increasing) and `x`, `y` (N, a force) or
// `value` (N m, or N for a prismatic effort).

#include <string>

#include "tangible/scene/scene.h"

namespace tangible {

enum class SignalColumns {
  kForce,  ///< x, y: at least one of them; one that is missing is 0
  kValue,  ///< value
};

/// Reads the file's series into signal->time and x, y or value; leaves the other fields. Columns
/// that the other kind of signal has may be there too and are ignored. On failure sets one line
/// "file: line 3: what, expected, got".
bool ReadSignal(const std::string& file, SignalColumns columns, Signal* signal, std::string* error);

}  // namespace tangible
