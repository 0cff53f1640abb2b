// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The JSON Schema of scene files, from which editors complete keys and mark mistakes.

#include "tangible/scene/json_writer.h"

namespace tangible {

/// A schema that every scene file that is read satisfies (json_schema.h), but for withdrawn keys.
OrderedJson SceneSchema();

}  // namespace tangible
