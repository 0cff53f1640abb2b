// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Gradients of the functions whose roots are events: a contact's gap, its sliding speed t v, the
// speed n v at which it opens, what is left to a servo's bound, and those of supports.

#include "tangible/dynamics/jacobian/equation_jacobian.h"

namespace tangible {

/// The sine of the angle between the normals of two contacts of a pair: 0 where the foot of a
/// rounded corner passes from an edge to a corner at its end, or back.
template <typename T>
T SineBetween(const ContactGeometry<T>& lost, const ContactGeometry<T>& next) {
  return Cross(lost.normal, next.normal);
}

/// Emits the entries of SineBetween.
void AddPassingGradient(const Model<double>& model, const State<double>& state,
                        const ActiveContact& lost, const ActiveContact& next,
                        LocalJacobianScratch* scratch, std::vector<JacobianEntry>* entries);

/// Emits the entries (row 0, variable, value) of the gap of a contact or limit, m or rad.
void AddGapGradient(const Model<double>& model, const State<double>& state,
                    const ActiveContact& contact, LocalJacobianScratch* scratch,
                    std::vector<JacobianEntry>* entries);
/// The same for the sliding speed of a contact of shapes, m/s.
void AddSlipGradient(const Model<double>& model, const State<double>& state,
                     const ActiveContact& contact, LocalJacobianScratch* scratch,
                     std::vector<JacobianEntry>* entries);
/// The same for the speed at which a contact opens, m/s; for a limit that of its coordinate, rad/s
/// or m/s.
void AddApproachGradient(const Model<double>& model, const State<double>& state,
                         const ActiveContact& contact, LocalJacobianScratch* scratch,
                         std::vector<JacobianEntry>* entries);

/// The same for L − sign u of a servo, N or N m (servo.h), of which the time is a variable too.
void AddServoGradient(const Model<double>& model, const State<double>& state, int servo,
                      double sign, double time, double middle, LocalJacobianScratch* scratch,
                      std::vector<JacobianEntry>* entries);

/// The same for the progress of a body, or of its point, that slows down on support k, whose last
/// motion is `at` (simulation/events/support_bounds.h).
void AddSupportProgressGradient(const Model<double>& model, const State<double>& state, int k,
                                const SupportState& at, LocalJacobianScratch* scratch,
                                std::vector<JacobianEntry>* entries);

/// The same for what is left of what support k can hold, W, at given forces of its rows; the
/// derivatives by these are written to by_wrench[3]. `at`: the motion that begins; `holds`: the
/// body or its point.
void AddSupportReserveGradient(const Model<double>& model, const State<double>& state, int k,
                               int holds, const SupportState& at, const double* wrench,
                               LocalJacobianScratch* scratch, double by_wrench[3],
                               std::vector<JacobianEntry>* entries);

}  // namespace tangible
