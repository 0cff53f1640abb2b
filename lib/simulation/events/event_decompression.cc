// SPDX-License-Identifier: Apache-2.0
//
// The second phase of an impact by Poisson's law. It includes only contacts on bodies that a
// rebounding contact pushes, directly or through joints and contacts.
#include <algorithm>

#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/segment_flow.h"

namespace tangible {
namespace {

// Bodies that move under forces and are connected with a contact that rebounds.
std::vector<bool> Reached(const ModelStructure& s, const Impulses& compression,
                          const std::vector<bool>& rebounds) {
  std::vector<bool> reached(s.bodies.size(), false);
  const auto moves = [&](int body) { return s.bodies[body].block >= 0; };
  bool more = false;
  const auto reach = [&](int body) {
    if (moves(body) && !reached[body]) {
      reached[body] = more = true;
    }
  };
  const auto spread = [&](int a, int b) {
    if ((moves(a) && reached[a]) || (moves(b) && reached[b])) {
      reach(a);
      reach(b);
    }
  };
  for (size_t i = 0; i < compression.contacts.size(); ++i) {
    if (rebounds[i] && compression.solution.normal_impulse[i] > 0.0) {
      reach(compression.contacts[i].a);
      reach(compression.contacts[i].b);
    }
  }
  while (more) {
    more = false;
    for (const JointIndex& joint : s.joints) {
      spread(joint.a, joint.b);
    }
    for (const ActiveContact& contact : compression.contacts) {
      spread(contact.a, contact.b);
    }
  }
  return reached;
}

}  // namespace

bool EventStepper::Decompress(const Model<double>& model, const Impulses& compression,
                              State<double>* state, StepReport* outcome) {
  const ModelStructure& s = *model.structure;
  const std::vector<bool> reached = Reached(s, compression, rebounds_);
  if (std::none_of(reached.begin(), reached.end(), [](bool x) { return x; })) {
    return true;
  }
  Impulses& impact = BeginImpulses(compression.time, *state);
  impact.decompression = true;
  impact.compressed.clear();
  for (size_t i = 0; i < compression.contacts.size(); ++i) {
    const ActiveContact& contact = compression.contacts[i];
    if (reached[contact.a] || reached[contact.b]) {
      impact.contacts.push_back(contact);
      impact.contacts.back().law = rebounds_[i] ? ContactLaw::kPoisson : ContactLaw::kInelastic;
      impact.friction.push_back(compression.friction[i]);
      impact.restitution.push_back(compression.restitution[i]);
      impact.compressed.push_back(static_cast<int>(i));
    }
  }
  AssembleImpulses(model, &assembly_, &impact);
  ContactSolution<double>& solution = impact.solution;
  const size_t count = impact.contacts.size();
  solution.modes.resize(count);
  solution.normal_impulse.assign(count, 0.0);
  solution.tangent_impulse.assign(count, 0.0);
  solution.joint_impulse.assign(3 * impact.problem.joints.size(), 0.0);
  for (size_t i = 0; i < count; ++i) {
    const int from = impact.compressed[i];
    solution.modes[i] = compression.solution.modes[from];
    if (impact.contacts[i].law == ContactLaw::kPoisson) {
      impact.problem.contacts[i].offset =
          impact.restitution[i].value * std::max(0.0, compression.solution.normal_impulse[from]);
    }
  }
  const ContactSolverReport solved =
      decompression_.Solve(SolverOptionsOf(s.settings), &impact.problem, &solution);
  CountSolve(solved, outcome);
  if (!solved.solved) {
    outcome->residual = solved.residual;
    outcome->message = "decompression of the impact: " +
                       (solved.worst_contact < 0 && s.joints.empty()
                            ? std::string("momentum")
                            : NameOfContact(s, impact.contacts, solved.worst_contact));
    return false;
  }
  TakeRollingLimits(solution, &impact.problem);
  decompression_.system().MoveFactorsTo(&impact.system);
  SpreadTwists(s, solution.motion, &state->twist);
  impact.new_twist = state->twist;
  return true;
}

}  // namespace tangible
