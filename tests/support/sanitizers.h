// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a test runs under the sanitizers: dense linear algebra takes 25 times as long there, and
// what differs in size alone is left to the release build.

namespace tangible::testing {

#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace tangible::testing
