// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Parametric pivoting on contact modes: Lemke's idea from any start, on sparse systems.
//
// The problem is joined to a nearby one that a given set of modes solves, by shifts of its
// inequalities that shrink with τ from 1 to 0. With δ and the centre λ⁰ of the proximal step
// (contact_system.h), per contact
//
//   λ' = λn + τ b
//   s' = n v + c_n + δ (λn − λn⁰) + τ a_n,   w' = t v + c_t + δ (λt − λt⁰) + τ a_t
//   s' ≥ 0,  λ' ≥ 0,  s' λ' = 0;   |λt| ≤ μ λ',   w' > 0 ⇒ λt = −μ λ',   w' < 0 ⇒ λt = μ λ'
//
// While the modes hold, the solution is affine in τ: two right-hand sides of one system. Where an
// inequality becomes tight, that contact changes its mode, and the path goes on in the direction
// (which may turn back) in which the new mode's inequality becomes slack. The path has finitely
// many pieces and ends at τ = 0, in a solution of the proximal problem, or runs to infinity. For
// bounded or little friction the map is monotone and the path reaches τ = 0. Contacts that are
// redundant, or nearly so (gaps of a lattice that differ by 1e-9 m), cost pivots but no accuracy: δ
// determines the impulses among them.
//
// Rolling friction is limited by ρ λ' of its contact, with which it opens and closes.
//
// Source: R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, 1992, section
// 4.5 (parametric methods); B. C. Eaves, On the basic theorem of complementarity, 1971.

#include <cstdint>
#include <vector>

#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

class ContactPivoting {
 public:
  /// Where the path starts: at the solution's modes, which makes it short where few are wrong; or
  /// at all contacts open, held apart by shifts, as in Lemke's method. On the copositive form of
  /// friction the latter path ends in a solution, but may be long.
  enum class From { kModes, kOpen };
  /// Follows the path from `solution`'s modes; its impulses are the centre of the proximal step.
  /// On success `solution` has the modes at τ = 0 and the proximal problem's solution; otherwise it
  /// is unchanged. Counts factorisations into `factorisations`.
  bool Solve(const ContactProblem<double>& problem, From from, double regularisation,
             int max_pivots, ContactSystem* system, ContactSolution<double>* solution,
             int* factorisations);
  void Reserve(int num_blocks, int num_contacts);
  /// Selects other shifts, spread over two powers of ten, for another path; 0: the default ones.
  void SetScatter(std::uint64_t seed) { scatter_ = seed; }

 private:
  // Shifts of a contact, and the centre of its impulses.
  struct Shift {
    double a_n = 0.0, a_t = 0.0, b = 0.0;
    double centre_n = 0.0, centre_t = 0.0;
  };
  // An inequality's value, value + rate τ.
  struct Test {
    double value = 0.0, rate = 0.0;
    ContactMode next = ContactMode::kOpen;  // the mode beyond it
    double At(double tau) const { return value + rate * tau; }
  };

  struct Event {
    int contact = -1;  // −1: none
    double distance = 0.0;
    ContactMode next = ContactMode::kOpen;
  };

  // A factor for one of a contact's shifts, so that no two inequalities become tight at once.
  double Scatter(size_t contact, int kind) const;
  void SetCentre(const ContactSolution<double>& solution);
  bool SolveSystem();
  bool Start(From from);
  void RaiseInequalities(From from);
  bool RaiseFurther();
  bool TurnsAtLimit(size_t i);
  void SetMode(size_t contact, ContactMode mode, double tau);
  int Tests(int contact, Test* tests) const;
  Event NextEvent(double tau, double direction) const;
  double Pivot(int contact, ContactMode next, double tau, double direction);
  Test Normal(int contact) const;
  Test Sliding(int contact) const;
  Test Impulse(int contact) const;
  Test Friction(int contact) const;
  void Extract(ContactSolution<double>* solution) const;

  const ContactProblem<double>* problem_ = nullptr;
  ContactSystem* system_ = nullptr;
  int* factorisations_ = nullptr;
  double regularisation_ = 0.0;
  std::uint64_t scatter_ = 0;
  std::vector<ContactMode> modes_;
  std::vector<Shift> shifts_;
  std::vector<double> x_;  // (value, rate) of the system's unknowns
  std::vector<double> joint_centre_;
};

}  // namespace tangible
