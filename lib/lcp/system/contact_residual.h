// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well a solution solves a contact problem, and how near it is to another mode: recomputed from
// the data.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The scales by which a solution's rows are judged: of what size the terms are that cancel in
/// them.
struct ContactScales {
  /// A body's speed, m/s, rotation at the radius of gyration: the largest of its solved twist, its
  /// free one M⁻¹ p and what one impulse changes it by, M⁻¹ rᵀ λ. A body that is pushed from both
  /// sides and stays at rest has rounding for the first two. Impulses count up to what the momenta
  /// of all bodies could bring about: rows that contradict each other have any impulses; and what
  /// they change a light body by up to 1e6 times the fastest twist's. At least 1e-6 of that.
  std::vector<double> speed;
  /// The arm, m, at which a body's speed scale is one of rotation: its radius of gyration, but at
  /// least a thousandth of the longest arm of its rows. A body of next to no inertia could turn at
  /// any speed at no cost, and beside that speed any row is met, whatever its other terms are: a
  /// box would fall through the floor with a small residual.
  std::vector<double> lever;
  double impulse = 0.0;  ///< the largest normal impulse, N s

  ContactScales() = default;
  ContactScales(const ContactProblem<double>& problem, const ContactSolution<double>& solution) {
    Compute(problem, solution);
  }
  void Compute(const ContactProblem<double>& problem, const ContactSolution<double>& solution);

 private:
  /// Speeds of the solved and the free twists; levers are radii of gyration.
  void ComputeSpeeds(const ContactProblem<double>& problem,
                     const ContactSolution<double>& solution);
  /// Speeds that impulses bring about; false where a lever is too short.
  bool AddPushes(const ContactProblem<double>& problem, const ContactSolution<double>& solution);
  void RaiseLevers(const ContactProblem<double>& problem, const ContactSolution<double>& solution);

  double total_ = 0.0;    ///< momentum of all bodies, N s
  double fastest_ = 0.0;  ///< speed of a solved or free twist, m/s
};

/// What a contact's rows are at a solution, with the scales by which they are judged.
struct ContactValues {
  double s_n, slip;         // n v + c_n, t v + c_t
  double sigma_n, sigma_t;  // sums of |terms|
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

/// The same; but where it is equations that exceed `tolerance`, v is made what the impulses say,
/// M v = p + Σ rᵀ λ, if that leaves less: what rounding leaves of a light body's momentum in a
/// system with far heavier ones belongs to the rows whose impulses are as large. Not for bodies at
/// dampers.
double BalancedResidual(const ContactProblem<double>& problem, double tolerance,
                        ContactSolution<double>* solution, int* worst_contact);

/// Which contacts of a solution are degenerate: impulse and slack both 0 to `tolerance` of their
/// scales, in the normal direction or at the limit of friction.
void FindDegenerateContacts(const ContactProblem<double>& problem,
                            const ContactSolution<double>& solution, double tolerance,
                            std::vector<int>* degenerate);

/// How far a contact is from a change of its mode, in the scales of NaturalResidual: the smallest
/// of the following:
///   open       s_n / σ_n
///   closed     (λ_n − o) / ζ, or where it is driven s_n / σ_n, and
///     sticking   (μ λ_n − |λ_t|) / ζ_t
///     sliding    |w| / σ_t
/// At most about 1; 0 at a kink, and below 0 by no more than the residual.
struct ContactMargin {
  enum class Kind { kOpening, kClosing, kFrictionLimit, kSlidingSpeed };
  double value = 0.0;
  Kind kind =
      Kind::kOpening;  ///< what changes: kClosing for an open contact, kOpening for a closed one
};
ContactMargin MarginOfContact(const ContactProblem<double>& problem,
                              const ContactSolution<double>& solution, const ContactScales& scales,
                              int contact);

/// The joint whose rows a v = b the speeds miss by the largest share of what their terms are at
/// speeds of the size `sizes` (3 a body; of a body at rest those that cancel in it, as its own are
/// rounding), if by more than `share`; −1: none, also where nothing was solved.
int MostViolatedJoint(const ContactProblem<double>& problem, const std::vector<double>& v,
                      const std::vector<double>& sizes, double share);

}  // namespace tangible
