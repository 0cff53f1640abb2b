// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/worker_pool.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tangible {
namespace {

TEST(WorkerPoolTest, EachTaskIsDoneOnceByAThreadOfThePool) {
  for (const int threads : {0, 1, 2, 4}) {
    WorkerPool pool(threads);
    for (const size_t count : {0, 1, 3, 1000}) {
      std::vector<std::atomic<int>> done(count);
      std::atomic<bool> known = true;
      pool.Run(count, threads, [&](size_t k, int thread) {
        ++done[k];
        known = known && thread >= 0 && thread < pool.threads();
      });
      for (const std::atomic<int>& times : done) EXPECT_EQ(times, 1);
      EXPECT_TRUE(known);
    }
  }
}

TEST(WorkerPoolTest, OneThreadOnRequestIsTheCallersInTurn) {
  WorkerPool pool(3);
  std::vector<size_t> order;
  pool.Run(20, 1, [&](size_t k, int thread) {
    EXPECT_EQ(thread, 0);
    order.push_back(k);
  });
  for (size_t k = 0; k < order.size(); ++k) EXPECT_EQ(order[k], k);
  EXPECT_EQ(order.size(), 20u);
}

TEST(WorkerPoolTest, WhatATaskThrowsReachesTheCallerAndThePoolGoesOn) {
  WorkerPool pool(2);
  const auto fails = [](size_t k, int) {
    if (k == 3) throw std::runtime_error("3");
  };
  EXPECT_THROW(pool.Run(10, 2, fails), std::runtime_error);
  std::atomic<int> done = 0;
  pool.Run(10, 2, [&](size_t, int) { ++done; });
  EXPECT_EQ(done, 10);
}

}  // namespace
}  // namespace tangible
