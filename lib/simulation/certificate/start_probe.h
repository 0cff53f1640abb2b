// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How a change of the initial motion affects contacts with friction that touch as a run starts.
//
// A contact that is opened with a small speed U closes again after 2 U / |a|, and the impulse of
// its landing replaces the impulse that its force would have had meanwhile: where all contacts
// close again in the same modes, the change of the twists is the one that restores their rows,
// whatever happens between. This does not hold where friction reverses the law of a contact
// (Painlevé): W = n M⁻¹ (n − μ sign(t v) t)ᵀ ≤ 0. There a landing at any speed causes an impulse of
// finite size that ends the slip (the contact jams), or the contact does not close again. The
// derivative, or the values, of the run at p then differ from those of runs on one side.
//
// Therefore the runs at p ± τ d and p ± τ d / 2 are compared with the run at p. With
//
//   R(τ) = x(p + τ d) − x(p) − τ D d,     x the state once the contacts have closed again,
//
// the map has the derivative D on that side where (4 R(τ/2) − R(τ)) / τ → 0; else R(τ/2) = R(τ)/2
// at a kink, R(τ) at a jump. τ is chosen such that U is 8 times the speed at which a contact leaves
// the touching tolerance; a finding is confirmed with a 16th of that, so that a kink near p is not
// taken for one at p.

#include <string>
#include <vector>

#include "tangible/simulation/stepping/step.h"

namespace tangible {

enum class StartKind { kSmooth, kKink, kJump };

struct StartFinding {
  StartKind kind = StartKind::kSmooth;
  ActiveContact contact;  ///< the one that opens, closes or jams
  std::string what;       ///< "jams at the start, bodies/rod/velocity/y opens it"
};

/// Whether friction and position allow a contact to jam: W ≤ 0 in one direction of sliding (within
/// a tenth), for bodies without joints; true for bodies that have joints, or contacts along several
/// normals.
bool MayJam(const Model<double>& model, const State<double>& start,
            const std::vector<ActiveContact>& touching, const ActiveContact& contact);

/// Probes one direction (num_variables), with its name, along which the speeds of `contacts`
/// change; these touch at the start without approaching. `acceleration`: upper limit for bodies
/// whose contact opens, m/s². Runs the first step or steps six times, and twelve times where
/// something is found.
StartFinding ProbeStart(const Model<double>& model, const State<double>& start,
                        const std::vector<ActiveContact>& contacts,
                        const VectorX<double>& direction, double acceleration,
                        const std::string& name);

}  // namespace tangible
