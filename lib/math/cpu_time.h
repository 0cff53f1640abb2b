// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The CPU time of a thread, which other work on the machine does not change.

#include <ctime>

namespace tangible {

/// The CPU time that the calling thread has used, s.
inline double ThreadCpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / 1e9;
}

}  // namespace tangible
