// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Accelerations and position corrections as contact problems: what event stepping integrates.
//
//   accelerations   M a − Aᵀ y − Σ(nᵀ λn + tᵀ λt) = f(q, v, t)     forces, N and N m
//                   A a = −Ȧ v          joints
//                   n a + ṅ v ≥ 0 ⊥ λn ≥ 0,  t a + ṫ v where it sticks      closed contacts
//   corrections     M δ − Aᵀ y − Σ nᵀ λn = 0,   A δ = −w C(q),   n δ = −gap(q)
//
// in the form of contact_problem.h with a (m/s²) or δ (m) in the place of v and forces or N s² in
// the place of impulses, so that its solvers serve. Damping is explicit here: a part of f. Which
// forces act, and which piece of a signal, is chosen at the time `middle` of a segment, so that the
// choice holds over it.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/elements/row_rates.h"

namespace tangible {

/// Memory of the assembly.
template <typename T>
struct AccelerationScratch {
  std::vector<JointRows<T>> joints;
  std::vector<JointRates<T>> rates;
  ContactRateScratch<T> contact;
};

/// A signal's column at t, on the piece that holds at `middle`; `slope` (may be null) its rate.
template <typename T>
T SignalAt(const Signal& signal, const std::vector<double>& column, const T& t, double middle,
           double* slope);

/// Force and torque (N, N, N m) on the body of a force at t; 0 where its window excludes `middle`.
template <typename T>
void ForceAt(const ModelStructure& structure, const ForceIndex& force,
             const std::vector<T>& numbers, const T& angle, const T& t, double middle, T out[3]);

/// The accelerations' problem at a state. The given contacts' c_n and c_t are ṅ v and ṫ v.
template <typename T>
void AssembleAcceleration(const Model<T>& model, const State<T>& state, const T& t, double middle,
                          const std::vector<ActiveContact>& contacts,
                          const std::vector<CoefficientSource>& friction,
                          AccelerationScratch<T>* scratch, ContactProblem<T>* problem);

/// The share of joint drift that a correction removes: 0, Baumgarte's fraction, or 1.
double JointCorrectionShare(const SimulationSettings& settings);

/// The corrections' problem at a pose. A contact whose law is kRecovery moves out of penetration by
/// `recovery` (m) and no more.
template <typename T>
void AssembleCorrection(const Model<T>& model, const State<T>& state,
                        const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction, const T& recovery,
                        AccelerationScratch<T>* scratch, ContactProblem<T>* problem);

}  // namespace tangible
