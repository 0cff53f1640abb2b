// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The supports of a fixed step, or of bodies that a motion between events finds at rest, or
// creeping (dynamics/elements/support.h): the contact problem of a step, or of accelerations, has
// their friction linearised about a twist û and the points that they hold as rows, and is solved
// again until
//
//   f_i = −μ N_i v_i⁺ / |v_i⁺|   where a point slides,   |f_i| ≤ μ N_i   where it is held
//
// Newton's method: û is the new twist of the last solve. What is held, and û where a point turned
// round, are those of the body alone, with the impulses that everything but its support gave it in
// the last solve: for a body that nothing touches the first solve is the solution. One that turns
// round again is held as a whole, which joints and contacts may do where it alone would go on.
// Where that goes round in circles, as where a hinge leaves a body one motion that the body alone
// would not choose, friction becomes dampers for a number of solves, of which each solution is the
// next û (the majorisation of Weiszfeld, with a smoothing that vanishes): they approach the
// solution without leaving it again, slowly, and tell by |v⁺| / |û|, which is |f| / (μ N), what is
// held. Newton's method goes on from there, and after that more dampers. Of bodies that are held
// together the shares are not determined, and those of the solve may exceed what one can give where
// others could give more: the dampers have found shares with which all are held. Of a body that
// turns about a point at rest, only that point is sought: its acceleration a + α × r − ω² r is that
// of a body with the acceleration a − ω² r, for which all of the above holds. A body of given
// motion may push others however large their friction: where a problem has no solution with what is
// held, all of it is let go, and û is the twist that the others then give it.

#include <array>
#include <cmath>
#include <vector>

#include "tangible/dynamics/elements/support.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

class SupportIteration {
 public:
  /// Chooses what the supports do in a step of length h. `problem` has been assembled without them.
  /// `sought`: empty, or which supports count, by SupportState::Holds; of accelerations (h = 1)
  /// those of bodies at rest, or a point at rest, whose accelerations stand for the new twists; of
  /// those that creep a + v / τ does (SupportState::horizon, which `before` gives).
  void Start(const Model<double>& model, double h, const ContactProblem<double>& problem,
             const std::vector<int>& sought, State<double>* before);
  /// The same from what `before` says that they do, which is near the solution.
  void StartAt(const Model<double>& model, double h, const std::vector<int>& sought,
               const State<double>& before);
  /// Whether the friction of a solved step is that of its new twists, to the tolerance of the LCP,
  /// and linearised about them; if it is not, linearises it anew in `before`, which is the state of
  /// the record. Where the friction keeps its direction it is right at once, but its derivative
  /// across that direction, −μ N / |v|, is that of the speed about which it is linearised.
  bool Accept(const Model<double>& model, const ContactProblem<double>& problem,
              const ContactSolution<double>& solution, State<double>* before);

  /// Sets the twists of what an accepted step holds at rest to 0: the solve leaves their rounding.
  static void KeepAtRest(const ModelStructure& structure, StepRecord* record);
  /// After a solve that has no solution, as where a body of given motion pushes one that is held:
  /// lets go what is held, without friction in the next solve: all of it, and after that the
  /// weakest. False where nothing is held.
  bool Release(const Model<double>& model, State<double>* before);

  bool has_given_up() const { return iterations_ >= kMostIterations; }
  /// Of μ N, at the last solve without dampers.
  double residual() const { return std::isfinite(residual_) ? residual_ : before_dampers_; }
  int worst_body() const { return worst_body_; }

 private:
  static constexpr int kNewton = 10;           ///< solves before the dampers
  static constexpr int kNewtonAfterwards = 8;  ///< and after them
  static constexpr int kDampers = 12;          ///< in the first round; the next has twice as many
  static constexpr int kMostIterations = 130;

  /// `has_share`: what the support holds is known to be within its limit.
  double ResidualOf(const SupportState& at, bool has_share, const double mass[3],
                    const double twist[3], const double* held) const;
  void Linearise(const double mass[3], const double twist[3], const double* held, bool has_share,
                 int* turns, SupportState* at) const;
  bool HasShare(size_t k, const SupportState& at) const {
    return at.holds != SupportState::kNothing && at.holds == shares_[k];
  }
  /// Linearises about a twist. A point that it does not move, as one at a pin, is held: its damper
  /// would have no bound.
  void MoveAbout(const double mass[3], const double twist[3], SupportState* at) const;
  double AwayFrom(const SupportState& at, const double mass[3], const double twist[3]) const;
  size_t NumParts() const { return friction_.is_disc() ? 1 : friction_.points().size(); }
  /// |v⁺| / √(v̂² + s²) of a part of a support with dampers: of the disc, or of a point.
  double RatioOf(const SupportState& at, size_t part, const double twist[3]) const;
  /// After the last solve with dampers: what is held, and the twist of what slides, by the ratios
  /// of the last solve and of the one before. Whether what slides does so by its own twist.
  bool Classify(const double twist[3], const double* ratios, const double* before,
                SupportState* at) const;
  int PartOf(size_t k) const { return sought_.empty() ? SupportState::kBody : sought_[k]; }
  /// Takes the friction of what is sought of a support, and what turns its twist into that of
  /// friction, m/s or m/s² (rad/s, rad/s²).
  void Set(const Model<double>& model, const State<double>& before, size_t k, double shift[3]);
  SupportState OfPart(size_t k, const SupportState& at) const;
  SupportState OfBody(size_t k, const SupportState& at) const;
  /// Visits what is sought: `at`, `twist` and `held` are of a support of that part alone.
  template <typename Visit>
  void ForEach(const Model<double>& model, const ContactProblem<double>& problem,
               const ContactSolution<double>& solution, State<double>* before, const Visit& visit);
  /// Holds what does not move although it was not held, as where a rail takes all that pushes it:
  /// derivatives are those of a body that is held. Whether there is anything, the first time.
  bool HoldStanding(const Model<double>& model, const ContactProblem<double>& problem,
                    const ContactSolution<double>& solution, State<double>* before);
  bool Stands(const SupportState& at, const double mass[3], const double twist[3]) const;
  void GoOnWithDampers(const Model<double>& model, const ContactProblem<double>& problem,
                       const ContactSolution<double>& solution, State<double>* before);
  void ImpulseOf(const SupportState& at, const double twist[3], const double* held,
                 double impulse[3]) const;

  double h_ = 0.0;
  int iterations_ = 0;
  int times_released_ = 0;
  double residual_ = 0.0;
  double before_dampers_ = HUGE_VAL;
  bool is_about_ = false;  ///< linearised once more since it settled
  bool has_held_standing_ = false;
  int newton_left_ = 0;     ///< solves until the next round of dampers
  int dampers_left_ = 0;    ///< of this round
  int dampers_ = kDampers;  ///< of the next round
  double smoothing_ = 1.0;  ///< of the speed that friction gives a body
  int worst_body_ = -1;
  SupportFriction friction_;
  std::vector<double> residuals_;
  std::vector<int> sought_;
  std::vector<double> horizons_;               ///< SupportState::horizon of each support
  std::vector<std::array<double, 3>> damped_;  ///< twists at the end of the last round of dampers
  std::vector<double> ratios_, last_ratios_;   ///< of the parts of all supports
  std::vector<int> shares_;  ///< what the dampers have found held, within the limit
  std::vector<int> turns_;   ///< how often each support has turned round in this step
};

}  // namespace tangible
