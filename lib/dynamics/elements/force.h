// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Forces and springs: the impulse of each over a step [t, t + h].
//
//   force    within [start, end] a constant F gives F · |[t, t+h] ∩ [start, end]|; a signal from a
//            file gives its integral over the overlap, so that a window that ends inside a step is
//            exact
//   spring   −h k (ℓ − L0) u on a's anchor, u = (p_a − p_b)/ℓ, at the poses of the step's start;
//            its damping is implicit: a damper with the row of u and weight h c
//   decay    of the friction F of a joint that slides at speed v (Armstrong-Hélouvry, Dupont,
//            Canudas de Wit 1994, Automatica 30, eq. 5): the contact of its friction holds it, and
//            slows it, with F (contact.h), of which this force takes off
//            sgn v (F − F_kinetic) (1 − exp(−(v / v_Stribeck)²)), whose slope at v = 0 is 0

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// ∫ of a column of a signal over [from, to] (0 where from ≥ to). Before its first and after its
/// last time a signal keeps the first and last value; between times it is constant or linear. An
/// empty column is 0.
double IntegrateSignal(const Signal& signal, const std::vector<double>& column, double from,
                       double to);

/// The length of [t, t + h] ∩ [start, end]; a null pointer means that this end is unbounded. Where
/// an end of the window coincides with an end of the step, the derivative is the mean of both
/// sides.
template <typename T>
T WindowOverlap(double t, double h, const T* start, const T* end);

/// The impulse (N s, N s, N m s) of a force on its body in a step. `numbers` are the parameters in
/// the order of ForceIndex; start and end may be null.
template <typename T>
void ForceImpulse(const ModelStructure& structure, const ForceIndex& force, double t, double h,
                  const T& angle, const T* numbers, const T* start, const T* end, T impulse[3]);

/// A column of a signal at t, by the piece that contains `middle`, whose slope is the derivative.
template <typename T>
T SignalAt(const Signal& signal, const std::vector<double>& column, const T& t, double middle);

/// The force and torque (N, N, N m) on the body of a force at t; 0 where its window excludes
/// `middle`. `numbers`, start and end are those of ForceImpulse.
template <typename T>
void ForceAt(const ModelStructure& structure, const ForceIndex& force, const T& angle,
             const T* numbers, const T* start, const T* end, const T& t, double middle, T out[3]);

/// The mean effort (N m, N) of a joint's signal over a step.
double MeanEffort(const ModelStructure& structure, const JointIndex& joint, double t, double h);

/// By how much the friction of a joint that slides is below that at rest, with the sign of the
/// speed (N, N m). `numbers` are the friction at rest, the kinetic friction and Stribeck's speed.
template <typename T>
T FrictionDecay(const T numbers[3], const T& speed);

template <typename T>
struct SpringRow {
  RowPart<T> row_a, row_b;  ///< of the rate of ℓ
  T tension;                ///< k (ℓ − L0), N: pulls the anchors together if > 0
  T length;                 ///< m
  RowPart<T> pull_a,
      pull_b;  ///< generalised force against which the spring pulls: k (d − L0 u) at the anchors
};

/// A spring at two poses; `numbers` are the parameters in the order of SpringIndex, d = p_a − p_b.
/// At coincident anchors the direction u is 0: there is no damping, and the force is k d, which is
/// smooth for L0 = 0.
template <typename T>
void EvaluateSpring(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                    SpringRow<T>* out);

}  // namespace tangible
