// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Counts a test program's allocations: link allocation_counter.cc, which replaces operator new.

namespace tangible::testing {

/// Calls of operator new so far, of all threads.
long NumAllocations();

}  // namespace tangible::testing
