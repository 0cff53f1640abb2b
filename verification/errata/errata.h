// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The errors in the method's published summary as printed, each compared with finite differences,
// for a body that slides on one contact.
//
// In the summary's symbols, with x = −v⁺ (the new twist) and z = (λn, λ+, λ−, γ):
//
//   M x + Gᵀ z = −q,     G x + F z + s = m,     s ≥ 0,  z ≥ 0,  sᵀ z = 0             (1)
//
//   K = [ M        Gᵀ              ]      Kᵀ (dx, dz) = (∂ℓ/∂x, ∂ℓ/∂z)               (2)
//       [ D(z) G   D(z) F − D(s)   ]
//
//   ∂ℓ/∂q = −dx     ∂ℓ/∂m = D(z) dz     ∂ℓ/∂M = −½ (dx xᵀ + x dxᵀ)
//   ∂ℓ/∂F = −D(z) dz zᵀ                 ∂ℓ/∂G = −(D(z) dz xᵀ + z dxᵀ)                (3)
//
//   q = M v + h f,   F = −[0 0 0; 0 0 E; μ −Eᵀ 0],   m = (c; 0; 0)                   (4)
//
// (1) to (4) are right. The summary prints instead:
//
//   differential   D(z) G  F − D(s) in the second row of K: without D(z) before F
//   gradient of G  −D(z) (dz xᵀ + z dxᵀ)
//   sign of q      q = −(M v + h f)
//   sign of F      F = [0 0 0; 0 0 E; μ −Eᵀ 0]
//
// Source: F. de Avila Belbute-Peres, K. Smith, K. Allen, J. Tenenbaum, J. Z. Kolter: End-to-end
// differentiable physics for learning and control. NeurIPS 2018, section 3.

#include <array>
#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"

namespace tangible {

enum class Misprint { kNone, kDifferential, kGradientOfG, kSignOfQ, kSignOfF };
inline constexpr std::array<Misprint, 4> kMisprints = {
    Misprint::kDifferential, Misprint::kGradientOfG, Misprint::kSignOfQ, Misprint::kSignOfF};
const char* NameOf(Misprint misprint);

/// A body of mass m and inertia I that touches a level floor at `arm` from its centre of mass and
/// slides; parameters in this order.
enum SlidingParameter {
  kMass,
  kInertia,
  kFrictionCoefficient,
  kArmX,
  kArmY,
  kVelocityX,
  kVelocityY,
  kAngularVelocity,
  kForceX,
  kGapSpeed,  ///< gap / h, m/s
  kNumSlidingParameters
};
const char* NameOf(SlidingParameter parameter);
using SlidingBody = std::array<double, kNumSlidingParameters>;

/// The body of the table.
SlidingBody ExampleBody();

/// The problem of its step (lcp/problem.h), rows (λn, λ+, λ−, γ); with the sign of q or F as
/// printed another problem.
MixedLcp<double> ProblemOf(const SlidingBody& body, Misprint misprint = Misprint::kNone);

/// The gradient of ℓ = w·v⁺ with respect to the parameters by (2), (3), (4), with one misprint in
/// (2) or (3), or none. Empty if the body does not slide.
std::vector<double> GradientByFormulas(const SlidingBody& body, Misprint misprint);
/// The same by central differences of solutions, extrapolated from two steps: for the right
/// problem, or with the sign of q or F as printed (which changes the solution itself: with the sign
/// of F as printed sliding is not possible at any speed, and friction holds whatever μ is). Empty
/// if not solved.
std::vector<double> GradientByDifferences(const SlidingBody& body, Misprint misprint);

struct ErrataTable {
  SlidingBody body{};
  std::vector<double> differences;
  std::vector<double> right;
  std::array<std::vector<double>, 4> printed;    ///< of kMisprints
  std::array<std::array<double, 3>, 5> twist{};  ///< v⁺: right, then of kMisprints
  int bodies = 0;               ///< random ones that slide; over all their parameters:
  double largest_right = 0.0;   ///< error of the right formulas, relative to the differences
  std::array<long, 4> wrong{};  ///< entries that a misprint changes
  std::array<double, 4> median_printed{};  ///< error of these
};
ErrataTable ComputeErrata();

/// The table as text (Markdown).
std::string ErrataText(const ErrataTable& table);

/// Empty if the right formulas agree with the differences (to 1e-9 of the example's, 1e-6 of the
/// random bodies') and each printed one is off by
/// 1 % or more in some entry; else one line.
std::string BrokenErrata(const ErrataTable& table);

}  // namespace tangible
