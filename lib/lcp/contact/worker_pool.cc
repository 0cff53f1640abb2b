// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/worker_pool.h"

#include <chrono>
#include <string>
#include <system_error>

#include "tangible/math/interrupt.h"

namespace tangible {
namespace {

constexpr std::chrono::milliseconds kBetweenChecks(20);

}  // namespace

int NumThreads(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  work_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void WorkerPool::TakeTasks(int thread) {
  try {
    for (size_t k = next_++; k < count_; k = next_++) {
      (*task_)(k, thread);
    }
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    error_ = error_ ? error_ : std::current_exception();
    next_ = count_;
  }
}

void WorkerPool::Wait(int thread) {
  std::uint64_t seen = 0;
  for (;;) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      work_.wait(lock, [&] { return ends_ || round_ != seen; });
      if (ends_) {
        return;
      }
      seen = round_;
    }
    TakeTasks(thread);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (--busy_ == 0) {
      done_.notify_one();
    }
  }
}

void WorkerPool::Start() {
  while (static_cast<int>(threads_.size()) < threads_wanted_ - 1) {
    const int thread = static_cast<int>(threads_.size()) + 1;
    try {
      threads_.emplace_back([this, thread] { Wait(thread); });
    } catch (const std::system_error& error) {
      throw std::system_error(error.code(), "thread " + std::to_string(thread + 1) + " of " +
                                                std::to_string(threads_wanted_) +
                                                " cannot be started");
    }
  }
}

// The caller's check for interrupts is that of all threads, and is called while the caller waits.
void WorkerPool::Run(size_t count, int threads, const std::function<void(size_t, int)>& task) {
  if (std::min(threads, threads_wanted_) == 1 || count <= 1) {
    for (size_t k = 0; k < count; ++k) {
      task(k, 0);
    }
    return;
  }
  Start();
  const std::function<void()>* const check = InterruptScope::Current();
  const std::function<void(size_t, int)> checked = [&](size_t k, int thread) {
    const InterruptScope scope(check);
    task(k, thread);
  };
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    task_ = check == nullptr ? &task : &checked;
    count_ = count;
    next_ = 0;
    error_ = nullptr;
    busy_ = static_cast<int>(threads_.size());
    ++round_;
  }
  work_.notify_all();
  TakeTasks(0);
  std::unique_lock<std::mutex> lock(mutex_);
  while (!done_.wait_for(lock, kBetweenChecks, [&] { return busy_ == 0; })) {
    if (error_) continue;
    lock.unlock();
    std::exception_ptr thrown;
    try {
      CheckInterrupt();
    } catch (...) {
      thrown = std::current_exception();
    }
    lock.lock();
    if (!thrown) continue;
    error_ = error_ ? error_ : thrown;
    next_ = count_;
  }
  if (error_) {
    std::rethrow_exception(error_);
  }
}

}  // namespace tangible
