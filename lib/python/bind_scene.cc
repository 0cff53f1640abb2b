// SPDX-License-Identifier: Apache-2.0
//
// Scenes.
#include <cmath>
#include <utility>

#include "tangible/python/binding.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible::python {
namespace {

Scene Parse(const std::string& text, const std::string& name, const std::string& folder) {
  Scene scene;
  std::string error;
  if (!ParseScene(text, name, folder, &scene, &error)) throw Error(error);
  return scene;
}

Scene Load(const std::string& file) {
  Scene scene;
  std::string error;
  if (!LoadScene(file, &scene, &error)) throw Error(error);
  return scene;
}

std::vector<ParameterPath> Resolve(const Scene& scene, const std::vector<std::string>& paths) {
  std::vector<ParameterPath> resolved(paths.size());
  std::string error;
  for (size_t i = 0; i < paths.size(); ++i) {
    if (!ResolveParameter(scene, paths[i], &resolved[i], &error)) throw Error(error);
  }
  if (!CheckApart(scene, resolved, &error)) throw Error(error);
  return resolved;
}

// The range in which all numbers that a path matches may be.
std::pair<double, double> RangeOf(const Scene& scene, const std::string& path) {
  Scene copy = scene;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&copy);
  std::pair<double, double> range(-HUGE_VAL, HUGE_VAL);
  const std::vector<ParameterPath> resolved = Resolve(scene, {path});
  for (const int number : resolved[0].numbers) {
    const NumberKind kind = numbers[static_cast<size_t>(number)].kind;
    if (kind != NumberKind::kFree) range.first = 0.0;
    if (kind == NumberKind::kFraction) range.second = 1.0;
  }
  return range;
}

Scene WithParameters(const Scene& scene, const std::vector<std::string>& paths,
                     const std::vector<double>& values) {
  Scene changed = scene;
  const std::string error = SetParameters(Resolve(scene, paths), values.data(), &changed);
  if (!error.empty()) throw Error(error);
  return changed;
}

}  // namespace

void BindScene(py::module_* module) {
  py::class_<Scene>(*module, "Scene")
      .def_static("parse", &Parse)
      .def_static("load", &Load)
      .def("to_json", &SceneToJson)
      .def("to_whole_json", &SceneWithSignalsToJson)
      .def(py::pickle(
          [](const Scene& scene) {
            return py::make_tuple(SceneWithSignalsToJson(scene), scene.path);
          },
          [](const py::tuple& state) {
            return Parse(state[0].cast<std::string>(), state[1].cast<std::string>(), "");
          }))
      .def("with_parameters", &WithParameters)
      .def_property_readonly("body_names",
                             [](const Scene& scene) {
                               std::vector<std::string> names;
                               for (const auto& body : scene.bodies) names.push_back(body.name);
                               return names;
                             })
      .def_property_readonly("num_steps",
                             [](const Scene& scene) { return NumSteps(scene.simulation); })
      .def("parameters",
           [](const Scene& scene) {
             Scene copy = scene;
             std::vector<std::tuple<std::string, double, std::string>> all;
             for (const SceneNumber<double>& number : EnumerateNumbers(&copy)) {
               all.emplace_back(number.path, *number.value, UnitOf(number.dimension));
             }
             return all;
           })
      .def("range", &RangeOf)
      .def("value", [](const Scene& scene, const std::string& path) {
        return Resolve(scene, {path})[0].value;
      });
}

}  // namespace tangible::python
