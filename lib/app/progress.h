// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Progress of long work and the remaining time, in one line on stderr if that is a terminal.

#include <chrono>
#include <string>

namespace tangible {

class Progress {
 public:
  /// `what`: the unit of `total`, for example "steps".
  Progress(std::string what, long total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows that `done` are done, at most five times a second and not in the first.
  void Show(long done);

 private:
  std::string what_;
  long total_;
  bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point began_;
  std::chrono::steady_clock::time_point next_;
  std::chrono::steady_clock::time_point looked_;  ///< when the clock was read last
  long stride_ = 1;
  long look_ = 0;  ///< when this many are done it is read again
};

}  // namespace tangible
