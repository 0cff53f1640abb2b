// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The study's tables, plots and page, from the JSON of its cells (study.h).

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tangible {

/// Tables of all cells that are there, as text.
std::string StudyTables(const std::vector<nlohmann::ordered_json>& cells);

/// The physics layer's share of a training iteration (TimePhysics), as a line.
std::string TimingLine(const nlohmann::ordered_json& timing);

/// Error against frames ahead, and against the share of labels, of billiards: two <svg> elements.
std::string ErrorByFrameSvg(const std::vector<nlohmann::ordered_json>& cells);
std::string ErrorByLabelsSvg(const std::vector<nlohmann::ordered_json>& cells);

/// A self-contained page that plays the true and the predicted pictures side by side. Pictures are
/// three planes of kPictureSize x kPictureSize bytes.
std::string PredictionPage(const std::string& title, const std::vector<std::string>& truth,
                           const std::vector<std::string>& predicted, const std::string& below);

}  // namespace tangible
