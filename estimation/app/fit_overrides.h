// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Flags of tangible-fit that change what its file asks for.

#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// "chain mass=20,friction=0.1" into the parameters; returns what is wrong or empty.
std::string OverrideInitial(const std::string& text, std::vector<FitParameter>* parameters);

/// --profile into the options; returns what is wrong or empty.
std::string ReadProfiles(const std::string& text, const RecordingsProblem& problem,
                         FitOptions* options);

}  // namespace tangible
