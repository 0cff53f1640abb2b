// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Random numbers that are the same everywhere: the standard library's distributions are not.

#include <cmath>
#include <numbers>
#include <random>

namespace tangible {

/// In (0, 1).
inline double Uniform(std::mt19937_64* random) {
  return (static_cast<double>((*random)() >> 11) + 0.5) / 9007199254740992.0;
}

/// In (low, high).
inline double Uniform(double low, double high, std::mt19937_64* random) {
  return low + (high - low) * Uniform(random);
}

/// Standard normal, by Box and Muller.
inline double Normal(std::mt19937_64* random) {
  const double radius = std::sqrt(-2.0 * std::log(Uniform(random)));
  return radius * std::cos(2.0 * std::numbers::pi * Uniform(random));
}

/// A generator for one of several tasks of a seed.
inline std::mt19937_64 Generator(unsigned seed, unsigned task) {
  std::seed_seq sequence{seed, task};
  return std::mt19937_64(sequence);
}

}  // namespace tangible
