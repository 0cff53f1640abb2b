// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether a step has no solution because a body whose motion is given presses others.

#include <string>
#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/model/model.h"
#include "tangible/lcp/contact/contact_solver.h"

namespace tangible {

/// Of an unsolved problem and its worst contact: empty, or a line that names a kinematic body that
/// touches what the contact's bodies touch, and says that it crushes them (no velocities satisfy
/// the contacts' inequalities, which a Farkas vector proves) or jams them (some do, and without
/// friction the problem is solved).
std::string WhoCannotYield(const ModelStructure& structure,
                           const std::vector<ActiveContact>& contacts,
                           const ContactProblem<double>& problem, int contact,
                           const ContactSolverOptions& options);

}  // namespace tangible
