// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the cart and pole. Each comment names the quantity of which the tolerance is a
// fraction or multiple, then the reason. The README has the table.

namespace tangible {

/// Of the state of the plant: the absolute and relative error of a step of its integrator, far
/// below the noise of the measurements.
inline constexpr double kIntegrationError = 1e-12;
/// Of 1, of states and forces: the step of the central differences with whose cost that of the
/// exact Jacobians is compared.
inline constexpr double kMapDifference = 1e-6;
/// Of 1, of inputs and outputs: an input of a perceptron that varies by less is not scaled further.
inline constexpr double kLeastDeviation = 1e-9;
/// Of the root of the mean squared gradient: added to it, so that Adam never divides by 0 (Kingma
/// and Ba).
inline constexpr double kAdamDivisor = 1e-8;

}  // namespace tangible
