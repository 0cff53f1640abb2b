// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/training_file.h"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <system_error>

#include "tangible/estimation/vision/checksum.h"

namespace tangible {
namespace {

constexpr std::string_view kMagicOfTraining = "tangible training 2\n";
constexpr std::string_view kMagicOfFirstTraining = "tangible training 1\n";

std::string IterationLine(long iteration) { return std::to_string(iteration) + " "; }

// A whole number that fills the text.
template <typename Number>
bool ReadWhole(std::string_view text, Number* number) {
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, *number);
  return read.ec == std::errc() && read.ptr == end;
}

// The next line without its end, which is taken from the text; false where none ends.
bool TakeLine(std::string_view* text, std::string_view* line) {
  const size_t end = text->find('\n');
  if (end == std::string_view::npos) return false;
  *line = text->substr(0, end);
  text->remove_prefix(end + 1);
  return true;
}

}  // namespace

std::string SerializeTraining(const TrainingFile& training) {
  const std::string iteration = IterationLine(training.iteration);
  const std::uint32_t sum = Checksum({training.fingerprint, "\n", iteration, training.weights});
  std::string bytes(kMagicOfTraining);
  bytes += training.fingerprint + "\n" + iteration + std::to_string(sum) + "\n";
  return bytes + training.weights;
}

bool ParseTraining(const std::string& bytes, const std::string& name_for_messages,
                   TrainingFile* training, std::string* error) {
  const auto fail = [&](const char* what) {
    *error = name_for_messages + ": " + what;
    return false;
  };
  if (bytes.empty()) return fail("expected a training's checkpoint, got an empty file: remove it");
  std::string_view rest = bytes;
  if (rest.substr(0, kMagicOfFirstTraining.size()) == kMagicOfFirstTraining) {
    return fail("expected a checkpoint of version 2, got one of version 1: remove it");
  }
  if (rest.substr(0, kMagicOfTraining.size()) != kMagicOfTraining) {
    return fail("expected a training's checkpoint, got another file");
  }
  rest.remove_prefix(kMagicOfTraining.size());
  std::string_view fingerprint, numbers;
  if (!TakeLine(&rest, &fingerprint) || !TakeLine(&rest, &numbers)) {
    return fail("expected a training's checkpoint, got one that ends in its header");
  }
  const size_t blank = numbers.find(' ');
  std::uint32_t sum = 0;
  if (blank == std::string_view::npos ||
      !ReadWhole(numbers.substr(0, blank), &training->iteration) ||
      !ReadWhole(numbers.substr(blank + 1), &sum) || training->iteration < 1) {
    return fail("expected an iteration >= 1 and a checksum in the third line");
  }
  if (Checksum({fingerprint, "\n", numbers.substr(0, blank + 1), rest}) != sum) {
    return fail("the checkpoint is damaged: its checksum is another one");
  }
  training->fingerprint = fingerprint;
  training->weights = rest;
  return true;
}

}  // namespace tangible
