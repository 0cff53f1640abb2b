// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/set_parameters.h"

#include <algorithm>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/validate.h"

namespace tangible {

bool CheckApart(const Scene& scene, const std::vector<ParameterPath>& parameters,
                std::string* error) {
  Scene copy = scene;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&copy);
  std::vector<const ParameterPath*> owner(numbers.size(), nullptr);
  for (const ParameterPath& parameter : parameters) {
    for (const int number : parameter.numbers) {
      if (owner[number] != nullptr) {
        *error = OneLine(parameter.path + ": expected numbers that no other parameter sets, got " +
                         numbers[number].path + ", which " + owner[number]->path + " sets");
        return false;
      }
      owner[number] = &parameter;
    }
  }
  return true;
}

std::string SetParameters(const std::vector<ParameterPath>& parameters, const double* values,
                          Scene* scene) {
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(scene);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    for (const int i : parameters[k].numbers) {
      if (!IsAllowed(numbers[i].kind, values[k])) {
        return OneLine(parameters[k].path + ": expected " + Describe(numbers[i].kind) + ", got " +
                       Describe(Json(values[k])));
      }
      *numbers[i].value = values[k];
    }
  }
  return Validate(*scene, "the scene with these values");
}

}  // namespace tangible
