// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/crush.h"

#include <utility>

#include "tangible/math/disjoint_sets.h"

namespace tangible {
namespace {

// The first kinematic body that touches one of the moving bodies which contacts connect to those of
// the given one; −1: none.
int KinematicNeighbour(const ModelStructure& structure, const std::vector<ActiveContact>& contacts,
                       int contact) {
  const auto moves = [&](int body) { return structure.bodies[body].motion == Motion::kMoving; };
  DisjointSets sets;
  sets.AddAll(structure.bodies.size());
  for (const ActiveContact& c : contacts) {
    if (c.IsOfShapes() && moves(c.a) && moves(c.b)) sets.Join(c.a, c.b);
  }
  const ActiveContact& worst = contacts[contact];
  if (!worst.IsOfShapes()) return -1;
  const int set = sets.Root(moves(worst.a) ? worst.a : worst.b);
  for (const ActiveContact& c : contacts) {
    if (!c.IsOfShapes()) continue;
    for (const auto& [own, other] : {std::pair(c.a, c.b), std::pair(c.b, c.a)}) {
      if (structure.bodies[own].motion == Motion::kKinematic && moves(other) &&
          sets.Root(other) == set) {
        return own;
      }
    }
  }
  return -1;
}

}  // namespace

std::string WhoCannotYield(const ModelStructure& structure,
                           const std::vector<ActiveContact>& contacts,
                           const ContactProblem<double>& problem, int contact,
                           const ContactSolverOptions& options) {
  const int body = contact < 0 ? -1 : KinematicNeighbour(structure, contacts, contact);
  if (body < 0) return "";
  const std::string who = structure.bodies[body].name + ", which cannot yield, ";
  if (ContactsProvedInfeasible(problem)) {
    return who + "crushes bodies: no motion keeps all of them apart";
  }
  ContactProblem<double> smooth = problem;
  for (ContactBlock<double>& block : smooth.contacts) {
    if (block.limit_given) continue;
    block.has_friction = false;
    block.friction = 0.0;
  }
  ContactSolution<double> solution;
  solution.modes.assign(smooth.contacts.size(), ContactMode::kClosed);
  solution.normal_impulse.assign(smooth.contacts.size(), 0.0);
  solution.tangent_impulse.assign(smooth.contacts.size(), 0.0);
  solution.joint_impulse.assign(3 * smooth.joints.size(), 0.0);
  ContactSolver solver;
  if (!solver.Solve(smooth, options, &solution).solved) return "";
  return who + "jams bodies by friction, without which they would give way";
}

}  // namespace tangible
