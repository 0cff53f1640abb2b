// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/fitted_scene.h"

#include <filesystem>
#include <optional>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

/// Converts the name of a file relative to one folder to one relative to another.
std::string Renamed(const std::string& file, const std::string& from, const std::string& to) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path path = JoinPath(from, file);
  if (fs::path(file).is_absolute()) {
    return file;
  }
  const fs::path renamed = fs::proximate(path, to.empty() ? fs::path(".") : fs::path(to), error);
  return error ? fs::absolute(path).string() : renamed.string();
}

}  // namespace

bool FittedScene(const FitProblem& problem, const Eigen::VectorXd& estimate,
                 const std::string& folder, std::string* text, std::string* error) {
  ParameterizedScene fitted;
  ParameterError fault;
  if (!fitted.Create(problem.scene, problem.points, problem.parameters, &fault,
                     problem.instruments)) {
    *error = fault.what;
    return false;
  }
  if (!fitted.Set(estimate)) {
    *error = "the estimate sets a number to a value that it may not take";
    return false;
  }
  Scene scene = fitted.scene();
  const std::string from = FolderOf(scene.path);
  const auto rename = [&](std::optional<Signal>* signal) {
    if (*signal) {
      (*signal)->file = Renamed((*signal)->file, from, folder);
    }
  };
  for (auto& joint : scene.joints) {
    rename(&joint.effort_signal);
  }
  for (auto& force : scene.forces) {
    rename(&force.force_signal);
    rename(&force.torque_signal);
  }
  *text = SceneToJson(scene);
  return true;
}

}  // namespace tangible
