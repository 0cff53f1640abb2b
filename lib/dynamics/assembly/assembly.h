// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// From scene physics to the contact problem of an instant, at one of three levels:
//
//   velocity       M v⁺ − Aᵀ y − Σ rᵀ λ = p     a step of length h at t, or an impact (h = 0)
//                  M = diag(m, m, I) + h diag(c, c, c_θ) + h Σ dampers       damping is implicit
//                  p = diag(m, m, I) v + h m g + impulses of springs, forces, efforts at t
//                  A v⁺ = b,  b = 0, or −(β/h) C(q) with Baumgarte's correction
//                  contacts: rows and constants of contact.h
//   acceleration   M a − Aᵀ y − Σ rᵀ λ = f(q, v, t),  M = diag(m, m, I)      damping is a part of f
//                  A a = −Ȧ v
//                  n a + ṅ v ≥ 0 ⊥ λn ≥ 0,  t a + ṫ v where it sticks
//   correction     M δ − Aᵀ y − Σ nᵀ λn = 0,   A δ = −w C(q),   n δ = −gap(q)
//
// each in the form of contact_problem.h, with a (m/s²) or δ (m) in the place of v, and forces or
// N s² in the place of impulses, so that its solvers serve. The element's equations stand in
// equations_inl.h. Bodies that do not move have no unknowns; their prescribed twists enter the
// constants.

#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/row_rates.h"

namespace tangible {

enum class Level : unsigned char { kVelocity, kAcceleration, kCorrection };

/// When the equations hold, and for how long. `T`: of accelerations the time is a variable.
template <typename T>
struct Instant {
  double t = 0.0, h = 0.0;     ///< velocity: the step's start and length, s
  bool corrects_drift = true;  ///< velocity: with Baumgarte's term, if the scene has it
  T time{0.0};                 ///< acceleration, s
  /// Acceleration: the time at which forces' windows and pieces of signals are chosen, so that the
  /// choice holds over a segment.
  double middle = 0.0;
  T recovery{0.0};  ///< correction: how far a contact of law kRecovery moves, m
};

/// What is evaluated on the way and needed again: poses, with their sines and cosines, and joint
/// rows at the start; memory of shapes.
template <typename T>
struct AssemblyScratch {
  std::vector<Pose<T>> poses;
  std::vector<JointRows<T>> joints;
  std::vector<JointRates<T>> rates;
  ContactRateScratch<T> contact;
};

/// Bodies, springs, forces, dampers and joints of a step; leaves the problem without contacts. With
/// h = 0 it is that of an impact: an instant in which no force, spring or damper acts. Without
/// `correct_drift` Baumgarte's term is left out. Allocates
/// nothing once its vectors have grown.
template <typename T>
void AssembleFree(const Model<T>& model, const State<T>& state, double t, double h,
                  ContactProblem<T>* problem, AssemblyScratch<T>* scratch,
                  bool correct_drift = true);

/// The contacts' blocks, with the given coefficients (one source a contact). `scratch` is that of
/// AssembleFree at the same state.
template <typename T>
void AssembleContacts(const Model<T>& model, const State<T>& state, double h,
                      const std::vector<ActiveContact>& contacts,
                      const std::vector<CoefficientSource>& friction,
                      const std::vector<CoefficientSource>& restitution,
                      AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The accelerations' problem at a state. The given contacts' c_n and c_t are ṅ v and ṫ v.
template <typename T>
void AssembleAcceleration(const Model<T>& model, const State<T>& state, const T& t, double middle,
                          const std::vector<ActiveContact>& contacts,
                          const std::vector<CoefficientSource>& friction,
                          AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The corrections' problem at a pose. A contact whose law is kRecovery moves out of penetration by
/// `recovery` (m) and no more.
template <typename T>
void AssembleCorrection(const Model<T>& model, const State<T>& state,
                        const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction, const T& recovery,
                        AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The share of joint drift that a correction removes: 0, Baumgarte's fraction, or 1.
double JointCorrectionShare(const SimulationSettings& settings);

/// The constant c_n of a contact's law, s_n = n·v⁺ + c_n (contact.h); `approach` is n·v before the
/// step, all bodies counted.
template <typename T>
T LawConstant(ContactLaw law, const T& gap, double h, const T& restitution, const T& approach,
              const SimulationSettings& settings) {
  switch (law) {
    case ContactLaw::kRestitution:
      return restitution * approach;
    case ContactLaw::kInelastic:
    case ContactLaw::kPoisson:  // its offset is the caller's
      return T(0.0);
    case ContactLaw::kRecovery:
      return T(-settings.recovery_speed);
    case ContactLaw::kGap:
      break;
  }
  return gap / h;
}

}  // namespace tangible
