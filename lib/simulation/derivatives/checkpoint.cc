// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/checkpoint.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace tangible {
namespace {

constexpr double kMebibyte = 1048576.0;
// No machine has more memory, and in bytes it is far below the limit of size_t.
constexpr double kMostMebibytes = 1e9;

// Reads the whole of `text` as a number.
template <typename Number>
bool ReadNumber(const std::string& text, Number* number) {
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, *number);
  return error == std::errc() && rest == end;
}

bool StartsWith(const std::string& text, const std::string& start, std::string* rest) {
  if (text.rfind(start, 0) != 0) {
    return false;
  }
  *rest = text.substr(start.size());
  return true;
}

}  // namespace

bool ParseCheckpointing(const std::string& text, Checkpointing* checkpointing, std::string* error) {
  std::string value;
  double mebibytes = 0.0;
  *checkpointing = Checkpointing();
  if (text == "all") {
    return true;
  }
  if (StartsWith(text, "every:", &value) && ReadNumber(value, &checkpointing->every) &&
      checkpointing->every >= 1) {
    checkpointing->kind = Checkpointing::Kind::kEvery;
    return true;
  }
  if (StartsWith(text, "budget:", &value) && ReadNumber(value, &mebibytes) && mebibytes > 0.0 &&
      mebibytes <= kMostMebibytes) {
    checkpointing->kind = Checkpointing::Kind::kBudget;
    checkpointing->budget = static_cast<size_t>(std::ceil(mebibytes * kMebibyte));
    return true;
  }
  *error =
      "expected all, every:K with K >= 1 or budget:MIB with 0 < MIB <= 1e9, got '" + text + "'";
  return false;
}

size_t Checkpoint::bytes() const {
  return sizeof(Checkpoint) + sizeof(double) * (state.pose.capacity() + state.twist.capacity()) +
         guess.bytes();
}

long CheckpointSpacing(long steps, size_t checkpoint_bytes, size_t record_bytes) {
  const double least =
      std::sqrt(static_cast<double>(steps) * static_cast<double>(checkpoint_bytes) /
                static_cast<double>(std::max<size_t>(1, record_bytes)));
  return std::clamp(std::lround(least), 1L, std::max(1L, steps));
}

}  // namespace tangible
