// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Builds the contact problem of a model at one of three levels:
//
//   velocity       M v⁺ − Aᵀ y − Σ rᵀ λ = p     a step of length h at t, or an impact (h = 0)
//                  M = diag(m, m, I) + h diag(c, c, c_θ) + h Σ dampers       damping is implicit
//                  p = diag(m, m, I) v + h m g + impulses of springs, forces, efforts at t
//                  A v⁺ = b,  b the prescribed twists' part
//                  contacts: rows and constants of contact.h
//   acceleration   M a − Aᵀ y − Σ rᵀ λ = f(q, v, t),  M = diag(m, m, I)      damping is a part of f
//                  A a = −Ȧ v
//                  n a + ṅ v ≥ 0 ⊥ λn ≥ 0,  t a + ṫ v where it sticks
//   correction     M δ − Aᵀ y − Σ nᵀ λn = 0,   A δ = −w C(q),   n δ = −gap(q)
//
// Each has the form of contact_problem.h, with a (m/s²) or δ (m) in the place of v, and forces or N
// s² in the place of impulses, so that the same solvers apply. The equations of each element stand
// in equations_inl.h. Bodies that forces do not move have no unknowns; their prescribed twists
// enter the constants, and at the level of accelerations those of bodies that follow a path.

#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/row_rates.h"
#include "tangible/dynamics/elements/servo.h"
#include "tangible/dynamics/elements/support.h"

namespace tangible {

enum class Level : unsigned char { kVelocity, kAcceleration, kCorrection };

/// The level, the time and the length of the step. The time is a `T` because it is a variable of
/// accelerations.
template <typename T>
struct Instant {
  double t = 0.0, h = 0.0;  ///< velocity: the step's start and length, s
  T time{0.0};              ///< acceleration, s
  /// Acceleration: the time at which windows of forces and pieces of signals are chosen, so that
  /// the choice is the same over a segment.
  double middle = 0.0;
  T recovery{0.0};  ///< correction: how far a contact of law kRecovery moves, m
};

/// Intermediate results that later functions use: poses with their sines and cosines, and joint
/// rows at the start; and memory for shapes.
template <typename T>
struct AssemblyScratch {
  std::vector<Pose<T>> poses;
  std::vector<JointRows<T>> joints;
  std::vector<JointRates<T>> rates;
  ContactRateScratch<T> contact;
  std::vector<T> given;  ///< the accelerations of driven bodies, in scenes that have some
};

/// Adds the bodies, springs, forces, dampers and joints of a step to a problem without contacts.
/// With h = 0 the problem is that of an impact: an instant in which no force, spring or damper
/// acts. Allocates nothing once its vectors have grown.
template <typename T>
void AssembleWithoutContacts(const Model<T>& model, const State<T>& state, double t, double h,
                             ContactProblem<T>* problem, AssemblyScratch<T>* scratch);

/// Adds the blocks of the contacts, with the given coefficients (one source for each contact).
/// `scratch` is that of AssembleWithoutContacts at the same state.
template <typename T>
void AssembleContacts(const Model<T>& model, const State<T>& state, double h,
                      const std::vector<ActiveContact>& contacts,
                      const std::vector<CoefficientSource>& friction,
                      const std::vector<CoefficientSource>& restitution,
                      AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The problem of accelerations at a state. c_n and c_t of the given contacts are ṅ v and ṫ v.
template <typename T>
void AssembleAcceleration(const Model<T>& model, const State<T>& state, const T& t, double middle,
                          const std::vector<ActiveContact>& contacts,
                          const std::vector<CoefficientSource>& friction,
                          AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The problem of a correction at a pose. A contact with the law kRecovery moves out of penetration
/// by at most `recovery` (m).
template <typename T>
void AssembleCorrection(const Model<T>& model, const State<T>& state,
                        const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction, const T& recovery,
                        AssemblyScratch<T>* scratch, ContactProblem<T>* problem);

/// The constant c_n of a contact's law, s_n = n·v⁺ + c_n (contact.h); `approach` is n·v of both
/// bodies before the step.
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
