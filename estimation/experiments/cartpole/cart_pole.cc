// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/cart_pole.h"

#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>
#include <vector>

#include "tangible/estimation/experiments/cartpole/tolerances.h"

namespace tangible {
namespace {

constexpr double kGravity = 9.81;

class EquationPlant : public CartPolePlant {
 public:
  explicit EquationPlant(const CartPole& numbers) : numbers_(numbers) {}

  CartPoleState Advance(const CartPoleState& state, double force, double seconds) override {
    using Values = std::vector<double>;
    namespace odeint = boost::numeric::odeint;
    Values values{state[0], state[1], state[2], state[3]};
    const auto rates = [&](const Values& at, Values& rate, double /*time*/) {
      Eigen::Map<CartPoleState>(rate.data()) =
          CartPoleRates(numbers_, Eigen::Map<const CartPoleState>(at.data()), force);
    };
    using Stepper = odeint::runge_kutta_fehlberg78<Values>;
    using Checker =
        odeint::default_error_checker<double, Stepper::algebra_type, Stepper::operations_type>;
    odeint::integrate_adaptive(
        odeint::controlled_runge_kutta<Stepper>(Checker(kIntegrationError, kIntegrationError)),
        rates, values, 0.0, seconds, 0.5 * seconds);
    return CartPoleState(values.data());
  }

 private:
  CartPole numbers_;
};

}  // namespace

double CartPole::PoleInertia() const {
  return pole_mass * (length * length + kPoleWidth * kPoleWidth) / 12.0;
}

CartPoleState CartPoleRates(const CartPole& numbers, const CartPoleState& state, double force) {
  const double arm = 0.5 * numbers.length;
  const double moment = numbers.pole_mass * arm;
  const double sine = std::sin(state[1]), cosine = std::cos(state[1]);
  const double omega = state[3];
  const double total = numbers.cart_mass + numbers.pole_mass;
  const double inertia = numbers.PoleInertia() + moment * arm;
  const double coupling = -moment * cosine;
  const double push = force - numbers.cart_damping * state[2] - moment * sine * omega * omega;
  const double torque = moment * kGravity * sine - numbers.pole_damping * omega;
  const double determinant = total * inertia - coupling * coupling;
  return {state[2], omega, (inertia * push - coupling * torque) / determinant,
          (total * torque - coupling * push) / determinant};
}

std::unique_ptr<CartPolePlant> MakeEquationPlant(const CartPole& numbers) {
  return std::make_unique<EquationPlant>(numbers);
}

}  // namespace tangible
