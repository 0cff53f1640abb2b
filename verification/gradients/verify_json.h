// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The result of a verification as JSON: every figure of the table, all exceptions with their
// reasons, and the worst entries with their scenes.

#include "tangible/scene/json_writer.h"
#include "tangible/verification/gradients/verify_run.h"

namespace tangible {

/// The result; numbers that are not finite are null. The caller adds the data that differ from run
/// to run (provenance).
OrderedJson ToJson(const VerifyResult& result);

}  // namespace tangible
