// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The origin of the figures of a verification: the build, and the machine on which it ran.

#include <string>
#include <utility>
#include <vector>

namespace tangible {

/// ("commit", "1a2b3c4"), ("compiler", "GNU 12.2.0"), ("flags", "-O3 ..."), ("cpu", "..."),
/// ("date", "2024-05-01T12:00:00Z"); "unknown" for values that cannot be determined. The commit is
/// that of the last configuration.
std::vector<std::pair<std::string, std::string>> Provenance();

/// The same as one line, "commit 1a2b3c4; compiler ...".
std::string ProvenanceLine();

}  // namespace tangible
