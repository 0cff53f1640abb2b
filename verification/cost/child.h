// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs work in a separate process, so that its peak memory can be measured and its budget is kept:
// the system ends it when it exceeds its CPU time or its memory.

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tangible::cost {

struct Budget {
  double seconds = 5.0;       ///< of CPU time, up to ChildLimits::Lift
  size_t bytes = 1ull << 30;  ///< of memory beyond that of this process when it starts
};

enum class ChildStatus { kDone, kOverSeconds, kOverBytes, kFailed };

struct ChildOutcome {
  ChildStatus status = ChildStatus::kFailed;
  std::string message;         ///< of kFailed, one line
  std::vector<double> values;  ///< of kDone: what the work returned
  std::string text;            ///< of kDone by TextChild
  size_t peak_bytes = 0;       ///< resident, of the whole process
  double cpu_seconds = 0.0;    ///< of the whole process
};

/// The interface through which the work controls its limits.
class ChildLimits {
 public:
  /// Removes the time limit: the following work may take longer.
  void LiftSeconds() const;
};

/// Runs `work` in a child of this process. It returns numbers, and a message where it failed. The
/// time of other processes is not counted, but the child ends after ten times its seconds in any
/// case.
ChildOutcome RunInChild(
    const Budget& budget,
    const std::function<std::vector<double>(const ChildLimits& limits, std::string* error)>& work);

/// Work that returns a text, in a child of this process from its construction on. Several may run
/// at the same time. The process itself should have one thread, because locks held by another
/// thread would remain locked in the child.
class TextChild {
 public:
  TextChild(const Budget& budget,
            const std::function<std::string(const ChildLimits& limits, std::string* error)>& work);
  ~TextChild();
  TextChild(TextChild&&) noexcept;
  TextChild& operator=(TextChild&&) = delete;
  /// Waits for the end; to be called once.
  ChildOutcome Wait();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tangible::cost
