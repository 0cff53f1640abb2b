// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// One-sided derivatives of a rollout of fixed steps: exact at kinks, where the tangent gives the
// element of the generalised Jacobian that belongs to the modes found.
//
// Each direction ẇ is carried through the steps separately: where a step's contacts are degenerate,
// its v̇⁺ solves a small LCP (contact_directional.h), elsewhere it is that of the tangent.
// Directional derivatives of piecewise smooth maps obey the chain rule, so that the result is
// lim (x(w + τ ẇ) − x(w)) / τ for τ → 0 from above; it is positively homogeneous in ẇ, not linear.
//
// Where redundant contacts contradict a direction (one of three supports in a row is raised), the
// shared impulses of the solution do not fit, and the direction determines which ones do: they are
// found from the linearised step a small way along the direction, and only their modes are taken
// from there.
//
// The method resolves contacts and joint limits that touch without force, friction at its limit,
// and friction coefficients that leave 0. It does not resolve jumps, nor kinks where corners and
// edges, the mixing rule or the constants of the contact law change, or where force windows
// coincide with steps.

#include <string>

#include "tangible/lcp/contact/contact_directional.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"

namespace tangible {

/// Whether a contact's slack n·v⁺ + c is within the rounding of its gap over h, and the change of
/// speed that its impulse causes: it touches without speed or load, and rounding decides whether it
/// is open or closed.
bool JustTouches(const StepRecord& record, size_t contact);

/// The directional derivative of the step that the stepper has just done.
class StepDirectional {
 public:
  /// `w_dot`: a direction in each column, as for RolloutTangent. False with one line in `message`
  /// where a step has no derivative along a direction: the direction contradicts redundant rows, or
  /// the LCP has no solution.
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
  DrivenSpeeds driven_;
  int first_column_ = 0;  // of those that SolveColumns receives
  ContactDirectional directional_;
  ContactSolver solver_;
  std::vector<ContactKink> kinks_;
  RowMatrixXd friction_;  // μ̇, contacts x columns
  LocalJacobianScratch scratch_;
};

/// Runs the rollout with its directions. A derivative that does not exist fails it, with the
/// message of StepDirectional and the time.
RolloutReport RolloutDirectional(ControlledModel<double> model, const State<double>& initial,
                                 const TangentObserver& observer, Stepper* stepper,
                                 RowMatrixXd* w_dot, State<double>* final);

}  // namespace tangible
