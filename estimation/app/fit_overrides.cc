// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/app/fit_overrides.h"

#include <algorithm>
#include <set>

#include "tangible/scene/csv.h"

namespace tangible {

std::string OverrideInitial(const std::string& text, std::vector<FitParameter>* parameters) {
  std::set<std::string> given;
  size_t begin = 0;
  while (begin < text.size()) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    begin = end + 1;
    const size_t equal = item.rfind('=');
    double value = 0.0;
    if (equal == std::string::npos || !ParseNumber(item.substr(equal + 1), &value)) {
      return "expected name=value, got '" + item + "'";
    }
    const std::string name = item.substr(0, equal);
    bool known = false;
    for (FitParameter& parameter : *parameters) {
      if (parameter.name == name) {
        parameter.initial = value;
        known = true;
      }
    }
    if (!known) {
      return "expected the name of a parameter, got '" + name + "'";
    }
    if (!given.insert(name).second) {
      return "expected one value of each parameter, got two of '" + name + "'";
    }
  }
  return "";
}

std::string ReadProfiles(const std::string& text, const RecordingsProblem& problem,
                         FitOptions* options) {
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    begin = end + 1;
    const std::vector<ParameterEntry>& entries = problem.entries();
    if (std::none_of(entries.begin(), entries.end(),
                     [&name](const ParameterEntry& entry) { return entry.name == name; })) {
      return "expected names of parameters, separated by commas, got '" + name + "'";
    }
    options->profiles.push_back(name);
  }
  return "";
}

}  // namespace tangible
