// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The supports of a fixed step, or of bodies that a motion between events finds at rest
// (dynamics/elements/support.h): the contact problem of a step, or of accelerations, has
// their friction linearised about a twist û and the points that they hold as rows, and is solved
// again until
//
//   f_i = −μ N_i v_i⁺ / |v_i⁺|   where a point slides,   |f_i| ≤ μ N_i   where it is held
//
// Newton's method: û is the new twist of the last solve. What is held, and û where a point turned
// round, are those of the body alone, with the impulses that everything but its support gave it in
// the last solve: for a body that nothing touches the first solve is the solution. One that turns
// round again is held as a whole, which joints and contacts may do where it alone would go on. A
// body of given
// motion may push others however large their friction: where a problem has no solution with what is
// held, all of it is let go, and û is the twist that the others then give it.

#include <vector>

#include "tangible/dynamics/elements/support.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

class SupportIteration {
 public:
  /// Chooses what the supports do in a step of length h. `problem` has been assembled without them.
  /// `are_at_rest`: empty, or which supports count; of accelerations (h = 1) those of bodies at
  /// rest, whose accelerations stand for the new twists.
  void Start(const Model<double>& model, double h, const ContactProblem<double>& problem,
             const std::vector<char>& are_at_rest, State<double>* before);
  /// Whether the friction of a solved step is that of its new twists, to the tolerance of the LCP,
  /// and linearised about them; if it is not, linearises it anew in `before`, which is the state of
  /// the record. Where the friction keeps its direction it is right at once, but its derivative
  /// across that direction, −μ N / |v|, is that of the speed about which it is linearised.
  bool Accept(const Model<double>& model, const ContactProblem<double>& problem,
              const ContactSolution<double>& solution, State<double>* before);

  /// Sets the twists of what an accepted step holds at rest to 0: the solve leaves their rounding.
  static void KeepAtRest(const ModelStructure& structure, StepRecord* record);
  /// After a solve that has no solution, as where a body of given motion pushes one that is held:
  /// lets go all that is held, without friction in the next solve. False where nothing is held.
  bool Release(State<double>* before);

  bool has_given_up() const { return iterations_ >= kMostIterations; }
  double residual() const { return residual_; }  ///< of μ N, at the last solve
  int worst_body() const { return worst_body_; }

 private:
  static constexpr int kMostIterations = 100;

  double ResidualOf(const SupportState& at, const double mass[3], const double twist[3],
                    const double* held) const;
  void Linearise(const double mass[3], const double twist[3], const double* held, int* turns,
                 SupportState* at) const;
  double AwayFrom(const SupportState& at, const double mass[3], const double twist[3]) const;
  void ImpulseOf(const SupportState& at, const double twist[3], const double* held,
                 double impulse[3]) const;

  double h_ = 0.0;
  int iterations_ = 0;
  double residual_ = 0.0;
  bool is_about_ = false;  ///< linearised once more since it settled
  int worst_body_ = -1;
  SupportFriction friction_;
  std::vector<double> residuals_;
  std::vector<char> at_rest_;
  std::vector<int> turns_;  ///< how often each support has turned round in this step
};

}  // namespace tangible
