// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The derivatives of the equations of an instant (assembly.h) with respect to its variables, entry
// by entry.
//
// The equations R(x; w) = 0 determine x = (v⁺, y, λ), (a, y, λ) or (δ, y, λ). Their variables are w
// = [poses | twists | parameters | t]; the time is a variable of accelerations only.
//   R1 = M x − p − Aᵀ y − Σ (nᵀ λn + tᵀ λt)              rows of moving bodies
//   R2 = A x − b                                         rows of joints
//   R3 = n x + c_n, and t x + c_t where sticking         rows of closed contacts
//        λn − e λ¹n where driven, at a fixed impulse λ¹n of the compression (law kPoisson)
// K = ∂R/∂x is the matrix of the solved system. This file gives ∂R/∂w at fixed x: each body,
// spring, force, joint and contact reads only a few variables, is evaluated in a LocalJet of these
// by the equations that assemble it (equations_inl.h), and its entries (row, variable, value) are
// passed on. Tangent and adjoint use the same entries:
//   tangent   K ẋ = −(∂R/∂w) ẇ            adjoint   Kᵀ u = x̄,  w̄ −= (∂R/∂w)ᵀ u
// Open contacts have no rows and no entries.
//
// The entries of bodies, of revolute and prismatic joints, and of contacts for a single column of
// the adjoint are written by hand; a test compares them with the templates, and jacobian/README.md
// has the times that this saves.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/model/driven_bodies.h"

namespace tangible {

/// Accumulates rhs(row, :) −= value w_dot(variable, :); both row-major with the same number of
/// columns. Variables whose derivative is known to be 0 may be marked in `fixed`.
struct TangentSink {
  const double* w_dot;
  double* rhs;
  int columns;
  const char* fixed = nullptr;
  void operator()(int row, int variable, double value) const {
    if (fixed != nullptr && fixed[variable] != 0) {
      return;
    }
    const double* from = w_dot + static_cast<size_t>(variable) * columns;
    double* to = rhs + static_cast<size_t>(row) * columns;
    for (int c = 0; c < columns; ++c) {
      to[c] -= value * from[c];
    }
  }
};

/// Accumulates w_bar(variable, :) −= value u(row, :).
struct AdjointSink {
  const double* u;
  double* w_bar;
  int columns;
  void operator()(int row, int variable, double value) const {
    const double* from = u + static_cast<size_t>(row) * columns;
    double* to = w_bar + static_cast<size_t>(variable) * columns;
    for (int c = 0; c < columns; ++c) {
      to[c] -= value * from[c];
    }
  }
};

/// AdjointSink for one column, for which the adjoint pays most.
struct SingleAdjointSink {
  const double* u;
  double* w_bar;
  void operator()(int row, int variable, double value) const { w_bar[variable] -= value * u[row]; }
};

/// Lists the entries themselves, for tests and for sums of magnitudes.
struct JacobianEntry {
  int row, variable;
  double value;
};
struct EntryListSink {
  std::vector<JacobianEntry>* entries;
  void operator()(int row, int variable, double value) const {
    entries->push_back({row, variable, value});
  }
};

/// The parts of a solved problem that its derivatives need. `restitution` is null for accelerations
/// and corrections.
struct SolvedEquations {
  Level level = Level::kVelocity;
  Instant<double> instant;
  const State<double>* state = nullptr;
  const std::vector<double>* new_twist = nullptr;  ///< velocity: of all bodies
  const std::vector<ActiveContact>* contacts = nullptr;
  const std::vector<CoefficientSource>* friction = nullptr;
  const std::vector<CoefficientSource>* restitution = nullptr;
  const ContactProblem<double>* problem = nullptr;
  const ContactSolution<double>* solution = nullptr;
  const std::vector<int>* contact_block = nullptr;  ///< −1: open
};

/// The index of the time among the variables of accelerations.
inline int TimeVariable(const ModelStructure& structure) { return structure.num_variables(); }

/// Memory for shapes as LocalJets and for the accelerations of all bodies.
struct LocalJacobianScratch {
  std::vector<LocalJet> numbers_a, numbers_b;
  ContactRateScratch<LocalJet> rates;
  std::vector<double> unknowns;
  std::vector<GivenEntry> given;
};

enum class JacobianRoute { kByHand, kGeneric };

/// Passes all entries of ∂R/∂w to a sink. The velocity level with h = 0 is an impact: an instant in
/// which no force acts.
template <typename Sink>
void VisitJacobian(const Model<double>& model, const SolvedEquations& solved, JacobianRoute route,
                   LocalJacobianScratch* scratch, const Sink& sink);

}  // namespace tangible
