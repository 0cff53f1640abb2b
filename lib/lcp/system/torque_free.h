// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which bodies of a contact problem its rows can turn. Normals exert no torque on a disc, nor does
// a hinge or a bar at its centre: without friction its new angular velocity is p_ω / I, and the
// solution of the problem leaves it out.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The effect of the rows of a problem on a body.
enum class Turning : unsigned char {
  kUntouched,  ///< it has no row
  kNone,       ///< rows, but none with an entry for its angle
  kTurned,
};

/// Determines this for each body from the rows of dampers, joints and contacts (their tangents
/// where they have friction), whatever the contacts' modes.
void FindTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning);
/// The same for several problems: adds the effect of the rows of one more.
void AddTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning);

/// How many bodies are Turning::kNone.
int CountAnglesLeftOut(const std::vector<Turning>& turning);

}  // namespace tangible
