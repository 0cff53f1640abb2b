// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Runs crowds (crowd_scene.h) by fixed steps and counts what is not solved.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"

namespace tangible::corpus {

struct CrowdOptions {
  int scenes = 0;                        ///< of each kind
  std::uint64_t seed = 1;                ///< of their generator
  int first = 0;                         ///< number of the first one
  int steps = 1000;                      ///< of each
  int most_bodies = 400;                 ///< in one scene, at least 20
  int threads = 1;                       ///< scenes at the same time
  std::function<void(long)> progress{};  ///< called with the number of finished scenes
};

/// The scenes of one kind.
struct CrowdRow {
  std::string kind;
  int scenes = 0;
  long steps = 0;             ///< done, of all scenes
  int contacts_max = 0;       ///< with an impulse in a step
  double residual_max = 0.0;  ///< scaled, of all steps of solved scenes
  double seconds_mean = 0.0;  ///< of CPU time, of a step
  double seconds_late = 0.0;  ///< that one step in a hundred exceeds
  int crushed = 0;            ///< scenes in which a body that cannot yield crushes another one
  std::vector<std::string> unsolved{};  ///< "stir 12: step 3 at ...", one a scene
};

std::vector<CrowdRow> RunCrowds(const CrowdOptions& options);

std::string TableText(const std::vector<CrowdRow>& rows);
OrderedJson ToJson(const std::vector<CrowdRow>& rows);
/// Empty, or a line about the first scene that is not solved, or not to kResidualBound.
std::string FirstFailure(const std::vector<CrowdRow>& rows);

}  // namespace tangible::corpus
