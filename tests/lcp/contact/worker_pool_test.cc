// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/worker_pool.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include "tangible/math/interrupt.h"

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

TEST(WorkerPoolTest, WhatAnotherThreadThrowsReachesTheCaller) {
  WorkerPool pool(2);
  std::atomic<int> begun = 0;
  // Each thread has one of the two tasks, because the first waits for the second to begin.
  const auto fails = [&](size_t, int thread) {
    ++begun;
    while (begun < 2) std::this_thread::yield();
    if (thread == 1) throw std::runtime_error("1");
  };
  EXPECT_THROW(pool.Run(2, 2, fails), std::runtime_error);
}

TEST(WorkerPoolTest, AfterAnExceptionNoFurtherTaskBegins) {
  WorkerPool pool(4);
  std::atomic<int> begun = 0;
  // The other threads would take a second for all.
  EXPECT_THROW(pool.Run(3000, 4,
                        [&](size_t k, int) {
                          if (k == 0) throw std::bad_alloc();
                          ++begun;
                          std::this_thread::sleep_for(std::chrono::milliseconds(1));
                        }),
               std::bad_alloc);
  EXPECT_LT(begun, 2000);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The address space that this process has, and a little: no room for the stacks of many threads.
class NoRoomForThreads {
 public:
  NoRoomForThreads() {
    ::getrlimit(RLIMIT_AS, &before_);
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit now = before_;
    now.rlim_cur = static_cast<rlim_t>(pages) * static_cast<rlim_t>(::getpagesize()) + (1U << 22U);
    ::setrlimit(RLIMIT_AS, &now);
  }
  ~NoRoomForThreads() { ::setrlimit(RLIMIT_AS, &before_); }
  NoRoomForThreads(const NoRoomForThreads&) = delete;
  NoRoomForThreads& operator=(const NoRoomForThreads&) = delete;

 private:
  rlimit before_{};
};

TEST(WorkerPoolTest, AThreadThatCannotStartIsAnExceptionAndLaterCallsTryAgain) {
  // More stacks than the few that the C library keeps of threads that have ended.
  WorkerPool pool(100);
  std::atomic<int> done = 0;
  const auto task = [&](size_t, int) { ++done; };
  {
    const NoRoomForThreads limit;
    try {
      pool.Run(1000, 100, task);
      ADD_FAILURE() << "expected an exception";
    } catch (const std::system_error& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find(" of 100 cannot be started"), std::string::npos) << what;
    }
  }
  EXPECT_EQ(done, 0);
  pool.Run(1000, 100, task);
  EXPECT_EQ(done, 1000);
}
#endif

// The caller's own task ends at once; it checks for interrupts while it waits, and the other
// threads have the same check.
TEST(WorkerPoolTest, TheCallerChecksForInterruptsWhileItWaits) {
  struct Interrupted {};
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<bool> interrupted{false};
  std::atomic<int> of_others{0};
  const std::function<void()> check = [&] {
    if (std::this_thread::get_id() == caller) {
      interrupted = true;
      throw Interrupted();
    }
    ++of_others;
  };
  WorkerPool pool(3);
  const InterruptScope scope(&check);
  const auto work = [&](size_t, int thread) {
    while (thread != 0 && (!interrupted || of_others == 0)) {
      CheckInterrupt();
      std::this_thread::yield();
    }
    // The others must have begun.
    while (thread == 0 && of_others == 0) std::this_thread::yield();
  };
  EXPECT_THROW(pool.Run(3, 3, work), Interrupted);
  EXPECT_GT(of_others, 0);
  // It can be used again, without a check.
  const InterruptScope none(nullptr);
  std::atomic<int> done{0};
  pool.Run(10, 3, [&](size_t, int) {
    CheckInterrupt();
    ++done;
  });
  EXPECT_EQ(done, 10);
}

}  // namespace
}  // namespace tangible
