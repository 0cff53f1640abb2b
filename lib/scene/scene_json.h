// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Scene files (README.md of this folder has every key, its unit and default).
//
// Every mistake is one line "file: /json/pointer: what, expected, got", the first one found. Beyond
// types and ranges, refused are: unknown keys and keys given twice; names that are not
// [A-Za-z0-9_.-]+ or not unique within their kind; unknown bodies; joints of a body with itself or
// between two bodies that do not move; an initial angle, displacement or rate of a joint in a loop
// or whose bodies[0] side is attached to the world; patterns that match nothing; bad signal files.

#include <string>

#include "tangible/scene/scene.h"

namespace tangible {

/// At most this many steps in a run.
inline constexpr double kMaxSteps = 1e9;

/// Reads a scene from a file; the files that it names are relative to its folder.
bool LoadScene(const std::string& file, Scene* scene, std::string* error);

/// Reads a scene from text. `name_for_messages` becomes scene->path.
bool ParseScene(const std::string& text, const std::string& name_for_messages,
                const std::string& folder_for_relative_files, Scene* scene, std::string* error);

/// The scene as text that ParseScene reads back bit for bit (every key but those that are absent,
/// so also an integrator and a correction of joints that follow the stepping); signals as the name
/// of their file, or as their series where that stands in the scene.
std::string SceneToJson(const Scene& scene);
/// The same with the series of all signals: it can be read in any folder.
std::string SceneWithSignalsToJson(Scene scene);

}  // namespace tangible
