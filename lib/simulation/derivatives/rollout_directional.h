// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// One-sided derivatives of a rollout of fixed steps: exact at kinks, where the tangent gives the
// element of the generalised Jacobian that belongs to the modes found.
//
// Each direction ẇ goes through the steps on its own: where a step's contacts are degenerate, its
// v̇⁺ solves a small LCP (contact_directional.h), elsewhere it is the tangent's. Directional
// derivatives of piecewise smooth maps obey the chain rule, so that what comes out is
// lim (x(w + τ ẇ) − x(w)) / τ for τ → 0 from above; it is positively homogeneous in ẇ, not linear.
//
// Where redundant contacts contradict a direction (one of three supports in a row is raised), the
// impulses that they share are not those at hand, but those that the direction singles out: they
// are found from the linearised step a small way along it, and only their modes are taken from
// there.
//
// What is resolved: contacts and joint limits that touch without force, friction at its limit, and
// friction that leaves 0. What is not: ties of corners and edges, of the mixing rule, of the law's
// constants and of force windows with steps, and jumps.

#include <string>

#include "tangible/lcp/contact/contact_directional.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"

namespace tangible {

/// Whether an open contact's slack n·v⁺ + c is within the rounding of its gap over h: it touches at
/// no speed, and whether it closes is open.
bool JustTouches(const StepRecord& record, size_t contact);

/// The directional derivative of the step that the stepper has just done.
class StepDirectional {
 public:
  /// `w_dot`: a direction a column, as RolloutTangent's. False with one line in `message` where a
  /// step has no derivative along a direction: the direction contradicts redundant rows, or the LCP
  /// has no solution.
  bool Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot,
             std::string* message);

 private:
  using Status = ContactDirectional::Status;
  bool FindKinks(const Model<double>& model, const StepRecord& record,
                 const ContactSolution<double>& solution, const RowMatrixXd& w_dot);
  Status SolveColumns(const Model<double>& model, const StepRecord& record,
                      const ContactSolution<double>& solution, const RowMatrixXd& w_dot,
                      RowMatrixXd* v_dot);
  Status SolveOne(const Model<double>& model, const StepRecord& record, const RowMatrixXd& w_dot,
                  RowMatrixXd* v_dot);
  bool ChooseImpulses(const Model<double>& model, const StepRecord& record,
                      const RowMatrixXd& w_dot, ContactSolution<double>* solution);
  void MoveAlong(const Model<double>& model, const StepRecord& record, const RowMatrixXd& w_dot,
                 ContactProblem<double>* problem);

  StepTangent tangent_;
  ContactDirectional directional_;
  ContactSolver solver_;
  std::vector<ContactKink> kinks_;
  RowMatrixXd friction_;  // μ̇, contacts x columns
  LocalJacobianScratch scratch_;
};

/// Runs the rollout with its directions. A derivative that does not exist fails it, with the
/// message of StepDirectional and the time.
RolloutReport RolloutDirectional(const Model<double>& model, const State<double>& initial,
                                 RowMatrixXd* w_dot, State<double>* final);

}  // namespace tangible
