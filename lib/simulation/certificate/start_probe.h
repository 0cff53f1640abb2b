// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a change of the initial motion does to contacts with friction that touch as a run starts.
//
// Thrown up with a small speed U a contact comes back after 2 U / |a|, and what it lands with is
// what its force would else have done: where all contacts close again as they were, the change of
// the twists is the one that restores their rows, whatever happens between. So it is not where
// friction turns the law of a contact around (Painlevé): W = n M⁻¹ (n − μ sign(t v) t)ᵀ ≤ 0. There
// a fall at any speed is an impulse of finite size that ends the slip (the contact jams), or what
// is thrown up does not come back. A run at p then has another derivative than those on one side,
// or other values.
//
// The runs at p ± τ d and p ± τ d / 2 themselves are compared with that at p. With
//
//   R(τ) = x(p + τ d) − x(p) − τ D d,     x the state once the contacts have closed again,
//
// the map has the derivative D on that side where (4 R(τ/2) − R(τ)) / τ → 0; else R(τ/2) = R(τ)/2
// at a kink, R(τ) at a jump. τ is such that U is 8 times the speed at which a contact leaves the
// touching tolerance, and is confirmed at a 16th of it, so that a kink nearby is none at p.

#include <string>
#include <vector>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

enum class StartKind { kSmooth, kKink, kJump };

struct StartFinding {
  StartKind kind = StartKind::kSmooth;
  ActiveContact contact;  ///< that opens, closes or jams
  std::string what;       ///< "jams at the start, bodies/rod/velocity/y opens it"
};

/// A contact whose friction and place let it jam: W ≤ 0 in one direction of sliding (within a
/// tenth), of bodies that have no joints; those that have, or have contacts along several normals,
/// may.
bool MayJam(const Model<double>& model, const State<double>& start,
            const std::vector<ActiveContact>& touching, const ActiveContact& contact);

/// Of one direction (num_variables), named, along which `contacts`, which touch at the start
/// without approaching, have speeds that change. `acceleration`: of what is thrown up, m/s², at
/// most. Runs the first step or steps six times, and twelve where something is found.
StartFinding ProbeStart(const Model<double>& model, const State<double>& start,
                        const std::vector<ActiveContact>& contacts,
                        const VectorX<double>& direction, double acceleration,
                        const std::string& name);

}  // namespace tangible
