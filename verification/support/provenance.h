// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where the figures of a verification come from: what was built how, and where it ran.

#include <string>
#include <utility>
#include <vector>

namespace tangible {

/// ("commit", "1a2b3c4"), ("compiler", "GNU 12.2.0"), ("flags", "-O3 ..."), ("cpu", "..."),
/// ("date", "2024-05-01T12:00:00Z"); "unknown" for what cannot be told. The commit is that of the
/// last configuration.
std::vector<std::pair<std::string, std::string>> Provenance();

/// The same as one line, "commit 1a2b3c4; compiler ...".
std::string ProvenanceLine();

}  // namespace tangible
