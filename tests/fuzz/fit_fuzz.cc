// SPDX-License-Identifier: Apache-2.0
// Any bytes as a fit file beside the data folder's scenes and observations: refused with one line,
// or its residuals are made.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tangible/estimation/results/fit_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string file = TANGIBLE_SOURCE_DIR "/data/fits/fuzzed.json";
  tangible::FitFile fit;
  std::string error;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const bool made =
      tangible::ParseFit(text, file, &fit, &error) && tangible::MakeProblem(fit, &error) != nullptr;
  if (made != error.empty() || error.find('\n') != std::string::npos) std::abort();
  return 0;
}
