// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Modes of a contact problem by sweeps and subspace solves: many modes change at a time.
//
// Without friction the impulses minimise the convex function
//
//   q(λ) = ½ vᵀ M v + cᵀ λ,   M v = p + Jᵀ λ,   λ ≥ 0,
//
// and with friction the tangent impulses do so within the limits that the normal ones set. Two
// kinds of step lower it in turn, and both keep λ within its limits:
//
//   sweep      projected Gauss-Seidel: each contact's impulses become those with which it alone
//              would satisfy its conditions. A sweep costs a fraction of a factorisation. It
//              changes modes freely, but what happens at one end of a pile reaches the other end
//              slowly.
//   subspace   the modes of the impulses are kept, and the linear system of these modes is solved,
//              with a compliance δ around the present impulses (contact_system.h), without
//              refinement. The impulses move towards its solution as far as q falls along the
//              projected way; where it does not, up to the first limit, where that contact changes
//              its mode.
//
// Once sweeps change no modes, δ falls to the size at which redundant rows that contradict each
// other by little more than rounding decide which of them carry force, and the modes are those of
// an active-set method: the first contact at its limit changes its mode, and where none is, those
// contacts whose speeds contradict their mode do.
//
// Joints and dampers are rows without limits, a damper's with the compliance 1 / weight.
//
// Source: M. Silcowitz, S. Niebe, K. Erleben, Projected Gauss-Seidel subspace minimization method
// for interactive rigid body dynamics, 2010; J. Nocedal, S. Wright, Numerical Optimization, 16.5,
// 16.7.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

class ContactDescent {
 public:
  /// Starts from the modes and impulses of `solution`. On return these are the last ones, which lie
  /// within the limits; true where the modes solve the problem with the least δ.
  bool Solve(const ContactProblem<double>& problem, ContactSystem* system,
             ContactSolution<double>* solution, int* factorisations);
  void Reserve(int num_bodies, int num_joints, int num_contacts);

 private:
  // A row on two bodies, of which one may be the fixed body behind the last.
  struct Row {
    int a, b;
    double row[6];
    double scaled[6];  // M⁻¹ rowᵀ
    double constant;
    double mobility;
  };
  // A row of a joint or damper: row v + compliance λ = right-hand side.
  struct Bilateral {
    Row row;
    double compliance;
    double impulse;
  };
  struct Contact {
    Row normal, tangent;
    double friction;
    double normal_impulse, tangent_impulse;
    double normal_target, tangent_target;  // of the subspace solve
    bool driven;
  };
  enum class Outcome { kFailed, kMoved, kBlocked, kSolved };

  void SetRow(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
              double constant, Row* row) const;
  void SetRows(const ContactSolution<double>& solution);
  double Speed(const Row& row) const;
  void Push(const Row& row, double impulse);
  void SetSpeeds();
  int Sweep(int count);
  int ReadModes();
  bool SolveSubspace(double delta);
  double Objective(double alpha) const;
  void Move(double alpha);
  double FirstLimit(int* contact, ContactMode* next) const;
  Outcome Subspace(double delta);
  void TakeBilaterals();
  int ChangeContradicted(double delta);
  bool Settle(double delta);
  bool Descend(int sweeps);

  const ContactProblem<double>* problem_ = nullptr;
  ContactSystem* system_ = nullptr;
  int* factorisations_ = nullptr;
  int solves_left_ = 0;
  std::vector<Bilateral> bilaterals_;
  std::vector<Contact> contacts_;
  std::vector<ContactMode> modes_;
  std::vector<int> changes_;
  std::vector<double> inverse_mass_;
  std::vector<double> v_;                // of the impulses; the fixed body last
  std::vector<double> x_;                // the solution of the modes
  mutable std::vector<double> momenta_;  // scratch
};

}  // namespace tangible
