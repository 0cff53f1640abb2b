// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The derivatives of a step's equations with respect to its variables, entry by entry.
//
// A step solves R(x; w) = 0 for x = (v⁺, y, λ), with the variables w = [poses | twists | numbers]:
//   R1 = (M + hC) v⁺ − M v − impulses − Aᵀ y − Σ (nᵀ λn + tᵀ λt)       rows of moving bodies
//   R2 = A v⁺ − b                                                       rows of joints
//   R3 = n v⁺ + c_n, and t v⁺ where sticking                            rows of closed contacts
//        λn − e λ¹n where driven, at a fixed impulse λ¹n of the compression (law kPoisson)
// K = ∂R/∂x is the step's own matrix. This file gives ∂R/∂w at fixed x: each body, spring, force,
// joint and contact reads a few variables only, is evaluated in a LocalJet of these and handed on
// as entries (row, variable, value). Tangent and adjoint use the same entries:
//   tangent   K ẋ = −(∂R/∂w) ẇ            adjoint   Kᵀ u = x̄,  w̄ −= (∂R/∂w)ᵀ u
// Open contacts have no rows and no entries. Revolute joints, which chains are made of, have their
// entries written by hand; a test compares them with the generic route.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"

namespace tangible {

/// Accumulates rhs(row, :) −= value w_dot(variable, :); both row-major with the same number of
/// columns. Variables that are known not to vary may be marked in `fixed`.
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

/// AdjointSink for one column: the case in which the adjoint pays.
struct SingleAdjointSink {
  const double* u;
  double* w_bar;
  void operator()(int row, int variable, double value) const { w_bar[variable] -= value * u[row]; }
};

/// Lists the entries themselves (tests, sums of magnitudes).
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

/// A solved step, as far as its derivative needs it.
struct SolvedStep {
  double time = 0.0;
  double h = 0.0;
  bool corrects_drift = true;  ///< whether Baumgarte's term, if the scene has it, is in it
  const State<double>* before = nullptr;
  const std::vector<double>* new_twist = nullptr;  ///< of all bodies
  const std::vector<ActiveContact>* contacts = nullptr;
  const std::vector<CoefficientSource>* friction = nullptr;
  const std::vector<CoefficientSource>* restitution = nullptr;
  const ContactProblem<double>* problem = nullptr;
  const ContactSolution<double>* solution = nullptr;
  const std::vector<int>* contact_block = nullptr;  ///< −1: open
};

/// Scratch: numbers of a polygon as LocalJets.
struct LocalJacobianScratch {
  std::vector<LocalJet> numbers_a, numbers_b;
};

enum class JointRoute { kByHand, kGeneric };

/// All entries of ∂R/∂w of a step; h = 0 is an impact: an instant in which no force acts.
template <typename Sink>
void VisitStepJacobian(const Model<double>& model, const SolvedStep& step, JointRoute route,
                       LocalJacobianScratch* scratch, const Sink& sink);

}  // namespace tangible
