// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The JSON Schema of fit files, from which editors complete keys and mark mistakes.

#include "tangible/scene/json_writer.h"

namespace tangible {

/// A schema that every fit file that is read satisfies (json_schema.h).
OrderedJson FitSchema();

/// Of the files that --design names; the schema of a fit has it as `$defs/design`.
OrderedJson DesignSchema();

}  // namespace tangible
