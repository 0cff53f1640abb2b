// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The one-sided derivative of a contact problem's solution, where it is at a kink.
//
// At a kink the solution is a piecewise linear function of the data: along a direction of the data
// it has a derivative, which is not linear in the direction. Contacts that are not degenerate keep
// their modes; the rates of a degenerate one satisfy the remaining complementarity conditions,
// where ṡ, ẇ are the rates of its speeds and λ̇ those of its impulses:
//
//   touches              s = λn = 0, sliding at w ≠ 0 or without friction:
//                        0 ≤ λ̇n ⊥ ṡ ≥ 0,  λ̇t = −σ μ λ̇n,  σ = sign w
//   touches at rest      s = λn = w = 0: Coulomb's law in the rates, |λ̇t| ≤ μ λ̇n
//   friction limit       λn > 0, w = 0, λt = −σ μ λn:
//                        λ̇t = −σ (μ λn)˙ + σ ξ,  0 ≤ ξ ⊥ σ ẇ ≥ 0
//   friction from zero   λn > 0, w = 0, μ = 0: |λ̇t| ≤ μ̇ λn, against ẇ
//
// With the system K of the other modes (contact_system.h), factorised once, a direction has
//
//   ẋ = K⁻¹ (r + B z),   0 ≤ z ⊥ q + W z ≥ 0
//
// a plain LCP of one to three rows for each degenerate contact, solved by the portfolio (solver.h).
// Source: J.-S. Pang, Newton's method for B-differentiable equations, Math. Oper. Res. 15 (1990)
// 311.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

struct ContactKink {
  enum class Kind : unsigned char {
    kNone,
    kTouches,
    kTouchesAtRest,
    kFrictionLimit,
    kFrictionFromZero
  };
  Kind kind = Kind::kNone;
  double sign = 0.0;  ///< σ; 0 without friction
};

/// Finds the kink of each contact; `tolerance` is relative to the scales of contact_residual.h, and
/// `touching[i]` says that a contact's slack and impulse are 0 where all of their terms are
/// rounding.
/// kFrictionFromZero is a kink only for directions in which μ changes.
void FindKinks(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
               const std::vector<bool>& touching, double tolerance,
               std::vector<ContactKink>* kinks);

class ContactDirectional {
 public:
  /// Factorises; false where the system of the other modes is singular. `problem` and `solution`
  /// must exist until the last Solve.
  bool Factor(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
              const std::vector<ContactKink>& kinks);

  /// The rows in which a direction is given, r = −(∂R/∂w) ẇ at fixed impulses and speeds: 3
  /// num_blocks(), bodies and joints first. blocks()[i] is the block of contact i, −1: none.
  /// According to modes() it has a normal row, and a tangent row if the contact sticks; degenerate
  /// contacts count as sticking wherever they may have friction.
  const std::vector<ContactMode>& modes() const { return row_modes_; }
  const std::vector<int>& blocks() const { return row_blocks_; }
  int num_blocks() const { return num_blocks_; }

  enum class Status {
    kSolved,
    kContradiction,  ///< with redundant rows: one of them opens or slips and the others do not
    kUnsolved,       ///< the LCP has no solution, or none was found
  };
  /// v̇ (3 num_bodies) along a direction; `friction` has μ̇ of each contact.
  Status Solve(const std::vector<double>& r, const std::vector<double>& friction,
               std::vector<double>* v_dot);

 private:
  enum class Part : unsigned char { kNormal, kTangent, kSpeed };
  // A row of the LCP. kNormal: λ̇n ⊥ ṡ. kTangent: ξ ⊥ σ ẇ, or λ̇t + μ λ̇n ⊥ ẇ⁺. kSpeed: ẇ⁻ ⊥ the
  // remaining friction, the row after its kTangent.
  struct Row {
    int contact;
    Part part;
    RowPart<double> row_a, row_b;    // of the speed
    RowPart<double> push_a, push_b;  // of the impulse
    double factor;                   // of the tangent row, ±1
  };
  void ListRows();
  void MakeMatrix();
  void FillBase(const std::vector<double>& r, const std::vector<double>& friction,
                std::vector<double>* x) const;
  bool Contradicts(const std::vector<double>& rhs, const std::vector<double>& x) const;
  VectorX<double> Constants(const std::vector<double>& r, const std::vector<double>& friction,
                            const std::vector<double>& x) const;

  const ContactProblem<double>* problem_ = nullptr;
  const ContactSolution<double>* solution_ = nullptr;
  std::vector<ContactKink> kinks_;
  std::vector<ContactMode> row_modes_, base_modes_;
  std::vector<int> row_blocks_;
  int num_blocks_ = 0;
  ContactSystem base_;
  std::vector<Row> rows_;
  std::vector<double> by_z_;  // K⁻¹ B
  MatrixX<double> W_;
};

}  // namespace tangible
