// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The result of a verification as text for a terminal.

#include <string>

#include "tangible/verification/gradients/verify_run.h"

namespace tangible {

/// "1.2e-11", "0", "-" for NaN (nothing was compared), "none" for infinity.
std::string ErrorText(double error);

/// Pairs that were compared in at least one scene, in the order of kMethodPairs.
std::vector<int> PairsShown(const VerifyResult& result);

/// A row for each scene and kind of parameter.
std::string TableText(const VerifyResult& result);

/// Exceptions, zero columns, sums by kind and over all kinds, coverage, the worst entries.
std::string SummaryText(const VerifyResult& result, bool random);

}  // namespace tangible
