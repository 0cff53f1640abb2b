// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The choice among impulses that are not unique.
//
// The motion v of a contact problem's solution determines only what its impulses do to the bodies.
// Impulses of redundant contacts form a polyhedron: with the contacts that touch without slip
// (s_n = w = 0), those that slide, and the joints,
//
//   Z = { (λ, y):  Σ (nᵀ λn + tᵀ λt) + Aᵀ y = M v − p,  λn ≥ 0,  |λt| ≤ μ λn,
//                  λt = −sign(w) μ λn where w ≠ 0 }                                           (1)
//
// of which a solver finds one point, often a corner. There a contact is at its limit (recorded as
// sliding at speed 0, or as closed without load), although another share of the impulses leaves it
// inside its cone. That changes derivatives: let z⁰ ∈ Z have every contact without slip strictly
// inside. For data changed by δ, consistently with the redundant rows, the system in which all of
// these stick has a solution (v + δv, z⁰ + δz), with a least δz of order |δ|; for small δ it
// satisfies all inequalities. It is a solution, and the map is smooth at a place where the modes of
// a corner of Z would let a contact slide that cannot.
//
// With the edges of the cones as rays, n ± μ t where w = 0 and n − sign(w) μ t else, (1) becomes
//
//   M (v' − v) = Σ rayᵀ α + Aᵀ y − (M v − p),   0 ≤ α ⊥ ray (v' − v) ≥ 0
//
// a problem of contacts without friction. It is monotone, its motion is v' = v, and the central
// path of the interior point method ends inside its set of solutions, where as many α as possible
// are positive. A contact is inside its cone where both of its rays are.
// A short way is tried first. All contacts without slip stick, but what is at a limit is pinned
// just inside it: friction at a share of the limit (as if it slid with less friction), a normal
// impulse of 0 at a small one (as if it were driven). Of the impulses with the same motion a
// proximal step finds the nearest; what it takes to a limit is pinned too, until nothing is. Where
// the impulses leave the motion as it is they are inside (1), and such points all have the same
// derivatives.
// Source: O. Güler, Y. Ye, Convergence behavior of interior-point algorithms, Math. Programming 60
// (1993) 215: the limit is a strictly complementary solution where there is one.

#include <vector>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/system/mode_solve.h"

namespace tangible {

class InnerImpulses {
 public:
  /// Replaces the impulses and modes of `solution` where others of the same motion leave fewer
  /// contacts at a limit (FindDegenerateContacts with `tolerance`); returns whether it did. Nothing
  /// where no contact is at a limit, which costs one pass over the contacts; else the short way, or
  /// where it leaves a contact at a limit a run of the interior point. The motion keeps its bits.
  bool Choose(const ContactProblem<double>& problem, double tolerance,
              ContactSolution<double>* solution);

 private:
  struct Ray {
    int contact;
    double side;  ///< λt = side · μ λn along the ray
  };
  void AddRays(const ContactProblem<double>& problem, double tolerance,
               const ContactSolution<double>& solution);
  void TakeRays(const ContactProblem<double>& problem);
  /// The short way to chosen_, with friction pinned at `share` of its limit; false where it leaves
  /// a contact at a limit, or another motion.
  bool ChooseNearby(const ContactProblem<double>& problem, double tolerance, double share,
                    const ContactSolution<double>& solution);
  /// Its first step: the modes of contacts inside their cones.
  void TakeInnerModes(const ContactProblem<double>& problem, double tolerance,
                      const ContactSolution<double>& solution);
  /// Pins what is at a limit in chosen_; whether anything is that was not pinned.
  bool PinAtLimits(const ContactProblem<double>& problem, double share);
  /// Whether chosen_ solves the problem; writes which of its contacts are at a limit.
  bool IsSolution(const ContactProblem<double>& problem, double tolerance);

  ContactSolver solver_;
  ModeSolve mode_solve_;
  ContactProblem<double> by_rays_, pinned_;
  std::vector<ContactMode> inner_modes_;
  double impulse_scale_ = 0.0;  ///< N s
  std::vector<Ray> rays_;
  ContactSolution<double> shares_, chosen_;
  std::vector<int> degenerate_;
};

}  // namespace tangible
