// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/cart_pole.h"

namespace tangible {

std::unique_ptr<CartPolePlant> MakeMujocoPlant(const CartPole& /*numbers*/) { return nullptr; }

}  // namespace tangible
