// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/closed_form.h"

#include <algorithm>
#include <utility>

namespace tangible {
namespace {

using NamedForm = std::pair<std::string, ClosedForm>;

std::vector<NamedForm>& Forms() {
  static std::vector<NamedForm> forms;
  return forms;
}

}  // namespace

void RegisterClosedForm(const std::string& name, ClosedForm form) {
  std::vector<NamedForm>& forms = Forms();
  const auto found = std::find_if(forms.begin(), forms.end(),
                                  [&](const NamedForm& known) { return known.first == name; });
  if (found != forms.end()) {
    found->second = std::move(form);
  } else {
    forms.emplace_back(name, std::move(form));
  }
}

void RemoveClosedForm(const std::string& name) {
  std::erase_if(Forms(), [&](const NamedForm& known) { return known.first == name; });
}

std::optional<ClosedFormJacobian> FindClosedForm(const Scene& scene,
                                                 const std::vector<ParameterPath>& parameters) {
  for (const auto& [name, form] : Forms()) {
    std::optional<ClosedFormJacobian> known = form(scene, parameters);
    if (known) {
      return known;
    }
  }
  return std::nullopt;
}

}  // namespace tangible
