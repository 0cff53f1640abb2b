// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which bodies of a contact problem its rows can turn. On a disc normals exert no torque, nor does
// a hinge or a bar at its centre: without friction its new angular velocity is p_ω / I, which the
// solution of the problem leaves out.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// What the rows of a problem do to a body.
enum class Turning : unsigned char {
  kUntouched,  ///< it has no row
  kNone,       ///< rows, but none with an entry for its angle
  kTurned,
};

/// Of each body, by the rows of dampers, joints and contacts (their tangents where they have
/// friction), whatever the contacts' modes.
void FindTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning);
/// The same of several problems: adds what the rows of one more do.
void AddTurning(const ContactProblem<double>& problem, std::vector<Turning>* turning);

/// How many bodies are Turning::kNone.
int CountAnglesLeftOut(const std::vector<Turning>& turning);

}  // namespace tangible
