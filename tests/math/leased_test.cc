// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/leased.h"

#include <gtest/gtest.h>

#include <list>
#include <set>
#include <thread>
#include <vector>

namespace tangible {
namespace {

struct Counted {
  std::vector<int> numbers;
};

TEST(LeasedTest, TheNextHolderHasTheMemoryOfTheLast) {
  const int* data = nullptr;
  {
    Leased<Counted> lease;
    lease->numbers.assign(100, 7);
    data = lease->numbers.data();
  }
  Leased<Counted> lease;
  EXPECT_EQ(lease->numbers.data(), data);
}

TEST(LeasedTest, NoTwoHoldersShareAnObject) {
  std::list<Leased<Counted>> leases;
  std::set<const Counted*> objects;
  for (int i = 0; i < 200; ++i) {  // more than there are slots
    leases.emplace_back();
    objects.insert(&*leases.back());
  }
  EXPECT_EQ(objects.size(), 200U);
}

TEST(LeasedTest, ThreadsDoNotMeet) {
  std::vector<std::thread> threads;
  std::vector<int> wrong(8, 0);
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([t, &wrong] {
      for (int k = 0; k < 2000; ++k) {
        Leased<Counted> lease;
        lease->numbers.assign(50, t);
        for (const int x : lease->numbers) wrong[t] += x != t ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(8, 0));
}

}  // namespace
}  // namespace tangible
