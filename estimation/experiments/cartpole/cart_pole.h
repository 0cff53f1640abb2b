// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Cart and pole: a cart on a straight rail, pushed along it by a force u, and a uniform pole hinged
// to it. This is the plant, which is controlled, and does not use the engine. With the angle φ of
// the pole from upright, counter-clockwise, a = length / 2, and the inertia I of the pole about its
// centre,
//
//   (M + m) v' − m a cos φ ω' + m a sin φ ω² = u − b v
//   −m a cos φ v' + (I + m a²) ω' = m g a sin φ − c ω
//
// (Lagrange's equations; Barto, Sutton, Anderson 1983 with viscous friction at cart and hinge).

#include <Eigen/Core>
#include <memory>

namespace tangible {

/// The default is the cart-pole of Deisenroth and Rasmussen (2011), with friction in the hinge.
struct CartPole {
  double cart_mass = 0.5;       ///< M, kg
  double pole_mass = 0.5;       ///< m, kg
  double length = 0.6;          ///< m
  double cart_damping = 0.1;    ///< b, N s/m
  double pole_damping = 0.005;  ///< c, N m s

  double PoleInertia() const;  ///< I, kg m²
};

inline constexpr double kPoleWidth = 0.02;      ///< m
inline constexpr double kCartPoleForce = 10.0;  ///< N: the largest |u|
inline constexpr double kCartPoleStep = 0.02;   ///< s, over which u is held

/// x of the cart (m), φ (rad), v (m/s), ω (rad/s).
using CartPoleState = Eigen::Vector4d;

/// The derivative of the state.
CartPoleState CartPoleRates(const CartPole& numbers, const CartPoleState& state, double force);

/// The system that is controlled.
class CartPolePlant {
 public:
  CartPolePlant() = default;
  virtual ~CartPolePlant() = default;
  CartPolePlant(const CartPolePlant&) = delete;
  CartPolePlant& operator=(const CartPolePlant&) = delete;
  /// The state after `seconds` under a constant force.
  virtual CartPoleState Advance(const CartPoleState& state, double force, double seconds) = 0;
};

/// The equations, by Boost.odeint's Runge-Kutta-Fehlberg 7(8) with errors of 1e-12 a step.
std::unique_ptr<CartPolePlant> MakeEquationPlant(const CartPole& numbers);

/// MuJoCo, with its own integrator in steps of 2 ms; null where it was not found at build.
std::unique_ptr<CartPolePlant> MakeMujocoPlant(const CartPole& numbers);

}  // namespace tangible
