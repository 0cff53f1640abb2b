// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/provenance.h"

#include <ctime>
#include <fstream>

namespace tangible {
namespace {

std::string CpuName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const size_t colon = line.find(':');
    if (line.rfind("model name", 0) == 0 && colon + 2 < line.size()) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

std::string Date() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  char text[32];
  if (gmtime_r(&now, &parts) == nullptr ||
      std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", &parts) == 0) {
    return "unknown";
  }
  return text;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> Provenance() {
  return {{"commit", TANGIBLE_COMMIT},
          {"compiler", TANGIBLE_COMPILER},
          {"flags", TANGIBLE_COMPILE_FLAGS},
          {"cpu", CpuName()},
          {"date", Date()}};
}

std::string ProvenanceLine() {
  std::string line;
  for (const auto& [what, value] : Provenance()) {
    line += line.empty() ? "" : "; ";
    line += what;
    line += ' ';
    line += value;
  }
  return line;
}

}  // namespace tangible
