// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <memory>

namespace tangible {

/// A scratch object for the time of a call, one of a few that all threads share, so that the
/// memory of one call serves the next and a repeated call allocates nothing. Its contents are those
/// that its last holder left.
///
/// It stands in the place of a `thread_local` object with a destructor: the C library records that
/// destructor in memory of its own when a thread first uses the object, and ends the process where
/// there is none left, while a vector here throws std::bad_alloc, which a caller can report.
template <typename T>
class Leased {
 public:
  Leased() {
    // A thread begins at the slot that it held last, which no other thread holds as a rule.
    thread_local size_t last = 0;
    for (size_t i = 0; i < kSlots; ++i) {
      Slot& slot = Slots()[(last + i) % kSlots];
      if (!slot.taken.exchange(true, std::memory_order_acquire)) {
        last = (last + i) % kSlots;
        slot_ = &slot;
        return;
      }
    }
    own_ = std::make_unique<T>();
  }
  ~Leased() {
    if (slot_ != nullptr) {
      slot_->taken.store(false, std::memory_order_release);
    }
  }
  Leased(const Leased&) = delete;
  Leased& operator=(const Leased&) = delete;

  T& operator*() { return slot_ != nullptr ? slot_->value : *own_; }
  T* operator->() { return &**this; }

 private:
  static constexpr size_t kSlots = 64;  // more threads than these allocate for each call

  struct Slot {
    std::atomic<bool> taken{false};
    T value{};
  };
  static std::array<Slot, kSlots>& Slots() {
    static std::array<Slot, kSlots> slots;
    return slots;
  }

  Slot* slot_ = nullptr;
  std::unique_ptr<T> own_;
};

}  // namespace tangible
