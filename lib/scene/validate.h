// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which scenes are allowed: the checks of a scene that concern several of its values at once, and,
// for one in memory, the ranges of its numbers.
//
// `place`: the item in the scene's file. Its value is not looked at, so that it may be a place of
// nothing (JsonReader::Nothing); messages take the values from the scene.

#include <string>

#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene.h"

namespace tangible {

void CheckBody(const BasicBody<double>& body, const JsonReader& place);
void CheckJoint(const BasicJoint<double>& joint, const JsonReader& place);
void CheckForce(const BasicForce<double>& force, const JsonReader& place);
void CheckSettings(const SimulationSettings& settings, const JsonReader& place);

/// Whether joints that may not start turned or moved (joint_graph.h) do.
void CheckInitialAngles(const Scene& scene, const JsonReader& joints);

/// Whether a kinetic friction is at most the friction at rest; a fit may move either, so that only
/// the reader of a scene demands this.
void CheckFrictionDecay(const std::optional<double>& kinetic, double friction,
                        const JsonReader& place);

/// Whether ropes (distance joints with limits) start within their limits. A fit may move a limit
/// beyond the distance at the start, so that only the reader of a scene demands this.
void CheckRopes(const Scene& scene, const JsonReader& joints);
/// Whether each coupling is of two joints that can be coupled (coupling.h).
void CheckCouplings(const Scene& scene, const JsonReader& joints);
/// Whether the initial rates obey the couplings that are kept, as CheckRopes where a scene is read:
/// a fit may move a rate. Bodies that follow a recorded path are not looked at, nor are ropes where
/// joints start turned.
void CheckCoupledRates(const Scene& scene, const JsonReader& joints);
/// The same of a scene in memory: "" or one line, as Validate.
std::string CoupledRatesFault(const Scene& scene, const std::string& name);

/// Whether a path has the columns that are offset; only the reader of a scene demands this, because
/// a number without an effect may be varied.
void CheckPathOffsets(const BasicDrivenMotion<double>& driven, const JsonReader& place);

/// All of these but the last three, and that every parameter is in its range. Returns "" or one
/// line that begins with `name` and names the first value that is not allowed as its place in a
/// scene file.
std::string Validate(const Scene& scene, const std::string& name);

}  // namespace tangible
