// SPDX-License-Identifier: Apache-2.0
//
// Stands before the C library (LD_PRELOAD) and counts how often a program reads a clock; the count
// is written to the file that the environment names as TANGIBLE_CLOCK_READS when the program ends.
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

std::atomic<long> reads{0};

struct AtExit {
  ~AtExit() {
    const char* const path = std::getenv("TANGIBLE_CLOCK_READS");
    std::FILE* const file = path == nullptr ? nullptr : std::fopen(path, "w");
    if (file == nullptr) return;
    std::fprintf(file, "%ld\n", reads.load());
    std::fclose(file);
  }
} at_exit;

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  ++reads;
  return static_cast<int>(::syscall(SYS_clock_gettime, clock, time));
}
