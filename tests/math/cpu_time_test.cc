// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/cpu_time.h"

#include <gtest/gtest.h>

#include <ctime>
#include <thread>

namespace tangible {
namespace {

constexpr double kWork = 0.02;  // s, far above the resolution of the clock

void Work() {
  for (const double start = ThreadCpuSeconds(); ThreadCpuSeconds() - start < kWork;) {
  }
}

TEST(ThreadCpuSecondsTest, CountsTheWorkOfThisThreadAlone) {
  const double start = ThreadCpuSeconds();
  std::thread(&Work).join();
  const double of_another = ThreadCpuSeconds() - start;
  EXPECT_GE(of_another, 0.0);
  EXPECT_LT(of_another, 0.5 * kWork);
  Work();
  EXPECT_GE(ThreadCpuSeconds() - start, kWork);
}

// The time of the only thread is that of the process.
TEST(ThreadCpuSecondsTest, CountsSeconds) {
  const std::clock_t process = std::clock();
  const double start = ThreadCpuSeconds();
  Work();
  const double seconds = static_cast<double>(std::clock() - process) / CLOCKS_PER_SEC;
  EXPECT_NEAR(ThreadCpuSeconds() - start, seconds, 0.1 * seconds);
}

}  // namespace
}  // namespace tangible
