// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The result of a verification as JSON: every figure of the table, what was an exception and why,
// and the worst entries with their scenes.

#include "tangible/scene/json_writer.h"
#include "tangible/verification/gradients/verify_run.h"

namespace tangible {

/// The result; numbers that are not finite are null. What differs from run to run (provenance) is
/// the caller's to add.
OrderedJson ToJson(const VerifyResult& result);

}  // namespace tangible
