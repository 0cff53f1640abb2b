// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/cpu_time.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace tangible
