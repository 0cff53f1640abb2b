// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace tangible {

Progress::Progress(std::string what, long total)
    : what_(std::move(what)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      began_(std::chrono::steady_clock::now()),
      next_(began_ + std::chrono::seconds(1)) {}

Progress::~Progress() {
  if (shown_) {
    std::fputs("\r\033[K", stderr);  // back to the start of the line, which is cleared
  }
}

void Progress::Show(long done) {
  if (!terminal_ || done <= 0 || done < look_) {
    return;
  }
  // Where much work is done between two readings of the clock, it is read less often.
  constexpr long kMostStride = 1024;
  const auto now = std::chrono::steady_clock::now();
  const auto since = now - looked_;
  if (since < std::chrono::milliseconds(10)) {
    stride_ = std::min(2 * stride_, kMostStride);
  } else if (since > std::chrono::milliseconds(50)) {
    stride_ = 1;
  }
  looked_ = now;
  look_ = done + stride_;
  if (now < next_) {
    return;
  }
  next_ = now + std::chrono::milliseconds(200);
  shown_ = true;
  const std::chrono::duration<double> spent = now - began_;
  const double left =
      spent.count() * static_cast<double>(total_ - done) / static_cast<double>(done);
  std::fprintf(stderr, "\r%ld of %ld %s, about %.0f s left\033[K", done, total_, what_.c_str(),
               std::ceil(left));
  std::fflush(stderr);
}

}  // namespace tangible
