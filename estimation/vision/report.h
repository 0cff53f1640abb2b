// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The study's tables, plots and page, from the JSON of its cells (study.h).

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tangible {

/// The tables of all cells that have results, as text.
std::string StudyTables(const std::vector<nlohmann::ordered_json>& cells);

/// The share of the physics layer in a training iteration (TimePhysics), as a line.
std::string TimingLine(const nlohmann::ordered_json& timing);

/// The errors for billiards over the frames ahead, and over the share of labels: two <svg>
/// elements.
std::string ErrorByFrameSvg(const std::vector<nlohmann::ordered_json>& cells);
std::string ErrorByLabelsSvg(const std::vector<nlohmann::ordered_json>& cells);

/// A self-contained page that plays the true and the predicted pictures side by side. Pictures are
/// three planes of kPictureSize x kPictureSize bytes.
std::string PredictionPage(const std::string& title, const std::vector<std::string>& truth,
                           const std::vector<std::string>& predicted, const std::string& below);

}  // namespace tangible
