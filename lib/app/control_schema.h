// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The JSON Schema of control problems, from which editors complete keys and mark mistakes.

#include "tangible/scene/json_writer.h"

namespace tangible {

/// Each start is a plan in memory.
inline constexpr int kMostStarts = 10000;

/// A schema that every control problem that is read satisfies (json_schema.h).
OrderedJson ControlSchema();

}  // namespace tangible
