// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A trade-off as a table, as JSON, as a picture and as a page; and the settings of a cell as a
// scene's block.

#include <string>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/verification/tradeoff/tradeoff_run.h"

namespace tangible::tradeoff {

/// The reference, the combinations left out, and a line for each cell on a front. An error below
/// the reference's own is marked *; T and G: on the front of trajectories, of gradients.
std::string TableText(const Tradeoff& tradeoff);

OrderedJson ToJson(const Tradeoff& tradeoff);

/// SVG: errors of trajectory and gradient over seconds. For one scene every cell, with a colour for
/// each stepping and integrator, and the fronts; for several scenes only the fronts.
std::string Picture(const std::vector<Tradeoff>& tradeoffs);

/// `provenance`: a line. Pictures and all cells of each scene.
std::string Page(const std::vector<Tradeoff>& tradeoffs, const std::string& provenance);

/// `"simulation": {...}` of a scene with these settings, every key, to be pasted into it.
std::string SimulationBlock(const Scene& scene, const SimulationSettings& settings);

/// Why no cell meets a target: the least errors of all cells, and the reference's own.
std::string WhyNone(const Tradeoff& tradeoff, double error);

}  // namespace tangible::tradeoff
