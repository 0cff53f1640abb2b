// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well a solution solves a contact problem, and how near it is to another mode: recomputed from
// the data.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The scales of a solution's rows: the size of the terms that cancel in them.
struct ContactScales {
  /// A body's speed, m/s, with rotation taken at the radius of gyration: the largest of its solved
  /// twist, its free twist M⁻¹ p, and the change M⁻¹ rᵀ λ that a single impulse causes. For a body
  /// that is pushed from both sides and stays at rest the first two are only rounding. Impulses
  /// count up to the momenta of all bodies together, because rows that contradict each other can
  /// have impulses of any size; the change of a light body's speed counts up to 1e6 times the speed
  /// of the fastest twist. The scale is at least 1e-6 of the speed of the fastest twist.
  std::vector<double> speed;
  /// The arm, m, that converts a body's speed scale to a scale of rotation: its radius of gyration,
  /// but at least a thousandth of the longest arm of its rows. A body of almost no inertia could
  /// turn at any speed at no cost, and compared with that speed every row would seem satisfied,
  /// whatever its other terms are: a box would fall through the floor with a small residual.
  std::vector<double> lever;
  double impulse = 0.0;  ///< the largest normal impulse, N s

  ContactScales() = default;
  ContactScales(const ContactProblem<double>& problem, const ContactSolution<double>& solution) {
    Compute(problem, solution);
  }
  void Compute(const ContactProblem<double>& problem, const ContactSolution<double>& solution);
  /// The speed of the fastest solved or free twist, m/s.
  double fastest() const { return fastest_; }

 private:
  /// Computes the speeds of the solved and the free twists, with radii of gyration as levers.
  void ComputeSpeeds(const ContactProblem<double>& problem,
                     const ContactSolution<double>& solution);
  /// Adds the speeds that impulses cause; false where a lever is too short.
  bool AddPushes(const ContactProblem<double>& problem, const ContactSolution<double>& solution);
  /// Friction of a given limit is a load as those of bodies are: a motor that its joint's friction
  /// holds at rest leaves all twists rounding.
  void AddGivenFriction(const ContactProblem<double>& problem,
                        const ContactSolution<double>& solution);
  void RaiseLevers(const ContactProblem<double>& problem, const ContactSolution<double>& solution);

  double total_ = 0.0;  ///< momentum of all bodies, N s
  double fastest_ = 0.0;
};

/// The values of a contact's rows at a solution, with their scales.
struct ContactValues {
  double s_n, slip;         // n v + c_n, t v + c_t
  double scale_n, scale_t;  // sums of |terms|
  double mobility_n, mobility_t;
};

/// Evaluates a contact at the solved speeds v.
ContactValues Evaluate(const ContactProblem<double>& problem, const ContactScales& scales,
                       const ContactBlock<double>& contact, const double* v);

/// The largest magnitude of a list of impulses.
double ImpulseScale(const std::vector<double>& impulses);

/// ζ of a contact's normal impulse.
double NormalScale(const ContactBlock<double>& contact, const ContactValues& values,
                   double impulse_scale);

/// Scaled natural residual: the largest over rows of |min(z/ζ, s/σ)|, with σ the sum of |terms| of
/// s and ζ the largest z of its kind (or σ over the row's mobility if that is larger), and the
/// equations' residuals scaled by their terms.
double NaturalResidual(const ContactProblem<double>& problem,
                       const ContactSolution<double>& solution, int* worst_contact);

/// The same; but where equations exceed `tolerance`, v is recomputed from the impulses,
/// M v = p + Σ rᵀ λ, if that leaves a smaller residual: in a system with far heavier bodies the
/// rounding in the momentum of a light body belongs to the rows whose impulses are as large. Bodies
/// with dampers are left out.
double BalancedResidual(const ContactProblem<double>& problem, double tolerance,
                        ContactSolution<double>* solution, int* worst_contact);

/// Finds the degenerate contacts of a solution: impulse and slack are both 0 to `tolerance` of
/// their scales, in the normal direction or at the limit of friction.
void FindDegenerateContacts(const ContactProblem<double>& problem,
                            const ContactSolution<double>& solution, double tolerance,
                            std::vector<int>* degenerate);

/// What has to stay above 0 for a contact to keep its mode, in its own unit, with the scale ζ or σ
/// of NaturalResidual:
///   open       s_n of σ_n
///   closed     λ_n − o of ζ, or where it is driven s_n of σ_n, and
///     sticking   μ λ_n − |λ_t| of ζ_t
///     sliding    |w| of σ_t
struct ContactSlack {
  enum class Kind { kOpening, kClosing, kFrictionLimit, kSlidingSpeed };
  Kind kind =
      Kind::kOpening;  ///< what changes: kClosing for an open contact, kOpening for a closed one
  double value = 0.0;
  double scale = 0.0;
};
/// Writes one or two slacks and returns their number.
int SlacksOfContact(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
                    const ContactScales& scales, int contact, ContactSlack slacks[2]);

/// How far a contact is from a change of its mode: the smallest of its slacks over their scales. At
/// most about 1; 0 at a kink, and below 0 by no more than the residual.
struct ContactMargin {
  double value = 0.0;
  ContactSlack::Kind kind = ContactSlack::Kind::kOpening;
};
ContactMargin MarginOfContact(const ContactProblem<double>& problem,
                              const ContactSolution<double>& solution, const ContactScales& scales,
                              int contact);

/// The joint whose rows a v = b are violated most, relative to their terms at speeds of the size
/// `sizes` (3 for each body; for a body at rest the speeds that cancel in it, because its own are
/// rounding), if the relative violation exceeds `share`; −1: none, also where nothing was solved.
int MostViolatedJoint(const ContactProblem<double>& problem, const std::vector<double>& v,
                      const std::vector<double>& sizes, double share);

}  // namespace tangible
