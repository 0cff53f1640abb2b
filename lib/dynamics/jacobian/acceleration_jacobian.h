// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The derivatives of accelerations' and corrections' equations (acceleration.h) with respect to
// their variables, entry by entry, as local_jacobian.h does for a step. The variables are:
//   w = [poses | twists | numbers | t]
// with the time t as one more row after the model's variables: signals change with it.

#include "tangible/dynamics/assembly/acceleration.h"
#include "tangible/dynamics/jacobian/local_jacobian.h"

namespace tangible {

/// Accelerations or corrections as solved, as far as their derivatives need them.
struct SolvedAcceleration {
  bool correction = false;
  double time = 0.0;
  double middle = 0.0;
  const State<double>* state = nullptr;
  const std::vector<ActiveContact>* contacts = nullptr;
  const std::vector<CoefficientSource>* friction = nullptr;
  const ContactProblem<double>* problem = nullptr;
  const ContactSolution<double>* solution = nullptr;
  const std::vector<int>* contact_block = nullptr;  ///< −1: open
};

/// Index of the time among the variables of event stepping.
inline int TimeVariable(const ModelStructure& structure) { return structure.num_variables(); }

/// All entries of ∂R/∂w.
template <typename Sink>
void VisitAccelerationJacobian(const Model<double>& model, const SolvedAcceleration& solved,
                               LocalJacobianScratch* scratch, const Sink& sink);

}  // namespace tangible
