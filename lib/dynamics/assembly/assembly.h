// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// From scene physics to the contact problem of a step of length h at time t.
//
//   M = diag(m, m, I) + h diag(c, c, c_θ) + h Σ dampers        damping is implicit
//   p = diag(m, m, I) v + h m g + impulses of springs, forces, efforts at the step's start
//   joints: A v = b, b = 0, or −(β/h) C(q) with Baumgarte's correction
//   contacts: rows of contact.h, only those in the given list
//
// Bodies that do not move have no unknowns; their prescribed twists enter the constants.

#include <vector>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/force.h"

namespace tangible {

/// What is evaluated on the way and needed again: poses, with their sines and cosines, and joint
/// rows at the step's start.
template <typename T>
struct AssemblyScratch {
  std::vector<Pose<T>> poses;
  std::vector<JointRows<T>> joints;
};

/// Bodies, springs, forces, dampers and joints; leaves the problem without contacts. With h = 0 it
/// is that of an impact: an instant in which no force, spring or damper acts. Without
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
                      const AssemblyScratch<T>& scratch, ContactProblem<T>* problem);

/// The constant c_n of a contact's law; `approach` is n·v before the step, all bodies counted.
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
    default:
      return gap / h;
  }
}

/// row · twist over the bodies of the row that do not move by forces (block < 0).
template <typename T>
T PrescribedSpeed(const ModelStructure& structure, const State<T>& state, int a,
                  const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
  T speed(0.0);
  for (int i = 0; i < 3; ++i) {
    if (structure.bodies[a].block < 0) {
      speed += row_a[i] * state.twist[3 * a + i];
    }
    if (structure.bodies[b].block < 0) {
      speed += row_b[i] * state.twist[3 * b + i];
    }
  }
  return speed;
}

}  // namespace tangible
