// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/interrupt.h"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

namespace tangible {
namespace {

TEST(InterruptTest, TheCheckIsThatOfTheInnermostScope) {
  int outer = 0;
  int inner = 0;
  const std::function<void()> count_outer = [&] { ++outer; };
  const std::function<void()> count_inner = [&] { ++inner; };
  CheckInterrupt();
  {
    const InterruptScope scope(&count_outer);
    CheckInterrupt();
    {
      const InterruptScope within(&count_inner);
      CheckInterrupt();
      const InterruptScope none(nullptr);
      CheckInterrupt();
    }
    CheckInterrupt();
  }
  CheckInterrupt();
  EXPECT_EQ(outer, 2);
  EXPECT_EQ(inner, 1);
}

TEST(InterruptTest, AnExceptionPassesAndEndsTheScope) {
  struct Interrupted {};
  const std::function<void()> check = [] { throw Interrupted(); };
  const auto run = [&] {
    const InterruptScope scope(&check);
    CheckInterrupt();
  };
  EXPECT_THROW(run(), Interrupted);
  EXPECT_NO_THROW(CheckInterrupt());
}

TEST(InterruptTest, ACheckBelongsToItsThread) {
  int calls = 0;
  const std::function<void()> check = [&] { ++calls; };
  const InterruptScope scope(&check);
  std::thread([] { CheckInterrupt(); }).join();
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace tangible
