// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Quantities that follow from the parameters of a fit, with intervals by the delta method:
//
//   f(p),   var f = ∇fᵀ C ∇f,   95 %: f ± 1.959964 sqrt(var f)
//
// C is the covariance of the fit; parameters without one (at a bound) are held. ∇f is computed by
// central differences, because f is a smooth function of the scene's parameters that takes no run.

#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct DerivedQuantity {
  std::string name;
  double estimate = 0.0;
  double standard_deviation = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 %
};

struct DerivedFunction {
  std::string name;
  std::function<double(const Scene&)> value;
};

/// `scene` is set to the estimate and keeps it.
std::vector<DerivedQuantity> Derive(const std::vector<DerivedFunction>& functions,
                                    const Eigen::VectorXd& estimate, const RowMatrixXd& covariance,
                                    ParameterizedScene* scene);

/// The combinations of inertial parameters that the motion of a double pendulum determines. In the
/// scene the bodies link1 and link2 hang straight below the joints `pivot` and `elbow`. With a_i
/// from joint to centre of mass and L1 from pivot to elbow, and
///
///   p1 = m1 a1² + I1 + m2 L1²,  p2 = m2 a2² + I2,  p3 = m2 L1 a2,  p4 = m1 a1 + m2 L1,
///
/// the quantities are p1/p3, p2/p3, p4/p3 (1/m), and g / L1 (1/s²).
std::vector<DerivedFunction> DoublePendulumQuantities();

/// For the body `pendulum` on the joint `pivot`, with a from pivot to centre of mass: the effective
/// length ℓ = (I + m a²) / (m a), m, and the damping ratio c / (2 sqrt((I + m a²) m g a)).
std::vector<DerivedFunction> SinglePendulumQuantities();

}  // namespace tangible
