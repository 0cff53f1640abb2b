// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The one class that starts threads: what a task throws and what keeps a thread from starting reach
// the caller as exceptions. The threads wait for work between calls, because the islands of a step
// take too little time to start threads for them.

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace tangible {

/// The number of threads for an option `threads`: 0 or less means one for each core.
int NumThreads(int threads);

/// Runs the indices of a loop on several threads, the caller's included.
class WorkerPool {
 public:
  /// Below 2: only the caller's thread works.
  explicit WorkerPool(int threads = 1) : threads_wanted_(std::max(1, threads)) {}
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool();

  int threads() const { return threads_wanted_; }

  /// task(0, ·) ... task(count − 1, ·), each once, in any order, the second argument the number of
  /// the thread; returns when all are done. With `threads` 1 the caller runs them in turn. If tasks
  /// throw, no further ones begin, and the first exception is rethrown here. If a thread cannot be
  /// started, no task begins, and std::system_error is thrown; a later call tries again.
  void Run(size_t count, int threads, const std::function<void(size_t, int)>& task);

 private:
  void Start();
  void Wait(int thread);
  void TakeTasks(int thread);

  const int threads_wanted_;
  std::vector<std::thread> threads_;  ///< started by the first Run with more than one task
  std::mutex mutex_;
  std::condition_variable work_, done_;
  std::uint64_t round_ = 0;
  int busy_ = 0;
  bool ends_ = false;
  const std::function<void(size_t, int)>* task_ = nullptr;
  size_t count_ = 0;
  std::atomic<size_t> next_ = 0;
  std::exception_ptr error_;
};

}  // namespace tangible
