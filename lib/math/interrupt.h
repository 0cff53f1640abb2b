// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Ends long computations early: a caller sets a check for its thread, and computations call it in
// each step of a run, forwards and backwards. An exception that the check throws ends them.
//
// The check belongs to the thread and not to arguments, because every function between a caller and
// the steps (methods of derivatives, certificates, fits) would have to hand it on.

#include <functional>

namespace tangible {

namespace internal {
inline thread_local const std::function<void()>* interrupt_check = nullptr;
}  // namespace internal

/// Calls the check of this thread, if it has one; what that throws passes through.
inline void CheckInterrupt() {
  if (internal::interrupt_check != nullptr) (*internal::interrupt_check)();
}

/// Sets the check of this thread as long as it lives, and then the one from before again.
class InterruptScope {
 public:
  /// `check` must outlive this object; null: there is none.
  explicit InterruptScope(const std::function<void()>* check) : before_(Current()) {
    internal::interrupt_check = check;
  }
  ~InterruptScope() { internal::interrupt_check = before_; }
  InterruptScope(const InterruptScope&) = delete;
  InterruptScope& operator=(const InterruptScope&) = delete;

  /// The check of this thread, for another one that works for it; null: none.
  static const std::function<void()>* Current() { return internal::interrupt_check; }

 private:
  const std::function<void()>* before_;
};

}  // namespace tangible
