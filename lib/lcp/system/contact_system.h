// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The linear system to which a contact problem reduces once the mode of each contact is known.
//
//   K [v; y; λ] = [p; b; −c],     K = [ M  −Aᵀ  −Bᵀ
//                                       A   δ    0
//                                       C   0    δ  ]
//
// C has the rows n (closed contacts) and t (sticking ones); B the directions in which impulses act:
// n − σ μ t for a sliding contact, so that K is unsymmetric there and the adjoint needs Kᵀ. A step
// is solved with this system, and differentiated with the same factorisation. A driven contact
// (contact_problem.h) has λn = o in place of its row n; its impulse acts like those of other
// contacts.
//
// δ regularises redundant rows (four legs on a floor, a closed loop of bars): 1e-10 of the row's
// own r M⁻¹ rᵀ, on contacts and, where joints form loops, on joints. Solutions are refined against
// the K without δ, so that δ only determines which of the possible impulses of redundant rows is
// found.
//
// Where several contacts are closed they are eliminated before factorisation
// (contact_condensation.h). Where refinement then stalls, the whole system is factorised instead.
//
// At extreme mass ratios δ exceeds the compliance of the bodies: a body of 1 kg between the floor
// and 1e12 kg has a mobility of 1 / kg if it is free, but of 1e-12 / kg together with the mass on
// it, and δ is a hundred times that. A round of refinement then removes only 1 % of the residual in
// that direction, and all of it in the others. There are no more such slow directions than such
// bodies, and conjugate residuals remove one in each round.

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "tangible/lcp/system/block_lu.h"
#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/lcp/system/torque_free.h"

namespace tangible {

/// Unknowns in blocks of three: bodies; joints; the closed contacts in order, each (λn, λt,
/// unused).
class ContactSystem {
 public:
  /// Assembles and factorises; false where singular.
  /// `regularisation`: δ as a fraction of r M⁻¹ rᵀ.
  bool Factor(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
              double regularisation = kContactRegularisation);
  /// Block of contact i, −1 if open.
  const std::vector<int>& contact_block() const { return contact_block_; }
  int num_blocks() const { return num_blocks_; }
  /// How often, since the start, a condensed system was factorised as a whole because refinement
  /// failed or it was singular.
  int expansions() const { return expansions_; }
  /// In how many proximal steps, since the start, redundant rows contradicted each other, by
  /// rounding or more, so that the solution depends on δ.
  int regularised_steps() const { return regularised_steps_; }
  /// Memory, bytes.
  size_t bytes() const {
    return lu_.bytes() + edges_.capacity() * sizeof(edges_[0]) +
           contact_block_.capacity() * sizeof(int) +
           sizeof(double) * (regularisation_.capacity() + rhs_.capacity() + correction_.capacity() +
                             last_.capacity()) +
           sizeof(Turning) * turning_.capacity();
  }
  void Reserve(int num_blocks, int num_edges);
  /// Whether solves need the problem, because they are refined against K without δ; the
  /// factorisation decides that. Otherwise they read only the factors, and any problem may be
  /// passed.
  bool needs_problem() const { return regularised_ || masses_differ_; }
  /// Whether rows depend on each other, so that the factors have δ.
  bool is_regularised() const { return regularised_; }
  /// Exchanges the symbolic factorisation of the system, which must be factorised anew before the
  /// next solve.
  void SwapPattern(std::shared_ptr<BlockLuPattern>* pattern) { lu_.SwapPattern(pattern); }
  /// Moves the factorisation to `other` (a tape keeps it); this object must be factorised anew
  /// before the next solve.
  void MoveFactorsTo(ContactSystem* other);

  /// x := K⁻¹ x or K⁻ᵀ x; x row-major of shape (3 num_blocks, columns). Returns the largest
  /// residual left, relative to the magnitude of its kind of row. Unused rows stay 0.
  double Solve(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
               double* x, int columns);
  double SolveTransposed(const ContactProblem<double>& problem,
                         const std::vector<ContactMode>& modes, double* x, int columns);

  /// x := (K with δ)⁻¹ x, refined: the proximal step, which has a solution even if redundant rows
  /// contradict each other. Returns as Solve does.
  double SolveRegularised(const ContactProblem<double>& problem,
                          const std::vector<ContactMode>& modes, double* x, int columns);
  /// The same without refinement: for modes that are still guesses.
  void SolveUnrefined(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                      double* x, int columns) const {
    SolveOnce<false>(problem, modes, x, columns);
  }
  /// The proximal step, and further ones as long as each halves the residual that δ causes: this
  /// gives the solution of K without δ where there is one, the regularised solution where redundant
  /// rows contradict each other. Returns as Solve does. `hopeless`, if given, sees x before it is
  /// refined; where it returns true the solve ends there, with an infinite residual.
  double SolveProximal(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                       double* x, int columns, const std::function<bool()>& hopeless = {});
  /// δ of every row, 3 num_blocks; 0 but on rows of closed contacts and of joints in loops.
  const std::vector<double>& regularisation() const { return regularisation_; }

  /// residual := rhs − K x (Kᵀ x if transposed) without δ; returns as Solve does.
  template <bool kTransposed>
  double Residual(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                  const double* rhs, const double* x, int columns, double* residual) const;

 private:
  enum class Regularisation { kLeftOut, kKept };
  // Largest magnitudes in a kind of row: of its terms and of its residual.
  struct RowScale {
    double terms = 0.0;
    // The products that a constraint's value sums, and those of the free motion: at rest all terms
    // cancel to rounding, which is relative to these.
    double parts = 0.0;
    double left = 0.0;
    void Term(double x) { terms = std::max(terms, std::abs(x)); }
    void Include(const RowScale& other);
    double Relative() const { return Ratio(terms); }
    double RelativeToParts() const { return Ratio(std::max(terms, parts)); }

   private:
    double Ratio(double scale) const {
      return scale > 0.0 ? left / scale : left > 0.0 ? HUGE_VAL : 0.0;
    }
  };
  // The residual of a column, or of all columns. Its largest entry is relative to the terms of its
  // kind of row, or to the products that these sum.
  struct ResidualSize {
    RowScale momentum, constraint;
    void Include(const ResidualSize& other);
    double ToTerms() const { return std::max(momentum.Relative(), constraint.Relative()); }
    double ToParts() const {
      return std::max(momentum.RelativeToParts(), constraint.RelativeToParts());
    }
  };
  // Scratch of refinement; a call leases it, rather than each system, because a tape keeps many
  // systems.
  struct RefinementScratch {
    std::vector<ResidualSize> sizes, next_sizes;  // of columns
    std::vector<char> refined;                    // whether a column is done
    std::vector<double> conjugate;
  };
  template <bool kTransposed>
  class ColumnResidual;
  // Momenta of the motion without constraints, whose speeds have the size of the terms that cancel
  // in rows: row-major, 3 num_bodies rows; of each column, or one for all.
  struct FreeMomenta {
    const double* values;
    int columns;
  };
  // Writes the size of each column's residual where `sizes` is given; returns the size over all
  // columns.
  template <bool kTransposed>
  ResidualSize ResidualWith(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, Regularisation regularisation,
                            const FreeMomenta& free, const double* rhs, const double* x,
                            int columns, double* residual, ResidualSize* sizes) const;
  template <bool kTransposed>
  double Refine(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                Regularisation regularisation, const FreeMomenta& free, double* x, int columns,
                double goal);
  // Solves for rhs_ with the whole system and less δ; infinite, with the condensed system, where
  // rows contradict each other all the same.
  double SolveWhole(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                    const FreeMomenta& free, double* x, int columns);
  bool Squeezes(const ContactProblem<double>& problem, const double* x, int columns) const;
  // Refines a column further by conjugate residuals, from its residual in `scratch`.
  template <bool kTransposed>
  void RefineConjugate(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                       Regularisation regularisation, const FreeMomenta& free, double* x,
                       int columns, int column, RefinementScratch* scratch);
  bool FactorAs(bool condensed, const ContactProblem<double>& problem,
                const std::vector<ContactMode>& modes);
  // Factorises the whole system in place of the condensed one if refinement left the residual
  // `left`; returns whether it did.
  bool Expand(double left, const ContactProblem<double>& problem,
              const std::vector<ContactMode>& modes);
  template <bool kTransposed>
  void SolveOnce(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                 double* x, int columns) const;
  void SetPattern(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes);
  void NarrowBlocks(const ContactProblem<double>& problem);
  void AddBodies(const ContactProblem<double>& problem);
  void AddJoints(const ContactProblem<double>& problem, double regularisation);
  void RegulariseContacts(const ContactProblem<double>& problem,
                          const std::vector<ContactMode>& modes);
  void AddContacts(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes);
  template <bool kTransposed>
  double RefinedSolve(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                      double* x, int columns);

  BlockLu<double> lu_;
  std::vector<std::pair<int, int>> edges_;
  std::vector<int> contact_block_;
  int num_blocks_ = 0;
  int first_contact_edge_ = 0;
  bool regularised_ = false;
  double give_ = 1.0;           ///< LargestGive
  bool masses_differ_ = false;  // so much that solves are refined
  bool condensed_ = false;
  int expansions_ = 0;
  int regularised_steps_ = 0;
  double fraction_ = kContactRegularisation;
  std::vector<double> regularisation_;
  std::vector<double> rhs_, correction_, last_;
  std::vector<Turning> turning_;
};

/// r M⁻¹ rᵀ with the diagonal of M: the change of the row's speed by a unit impulse along it if its
/// bodies were free.
template <typename T>
double RowMobility(const std::vector<T>& mass, int a, const RowPart<T>& row_a, int b,
                   const RowPart<T>& row_b) {
  double sum = 0.0;
  for (int i = 0; i < 3 && a >= 0; ++i) {
    sum += ValueOf(row_a[i]) * ValueOf(row_a[i]) / ValueOf(mass[3 * a + i]);
  }
  for (int i = 0; i < 3 && b >= 0; ++i) {
    sum += ValueOf(row_b[i]) * ValueOf(row_b[i]) / ValueOf(mass[3 * b + i]);
  }
  return sum;
}

/// The same of row k of a joint.
template <typename T>
double JointMobility(const std::vector<T>& mass, const JointBlock<T>& joint, int k) {
  return RowMobility(mass, joint.a, joint.row_a[k], joint.b, joint.row_b[k]) +
         (joint.c >= 0 ? RowMobility(mass, joint.c, joint.row_c, joint.d, joint.row_d) : 0.0);
}

}  // namespace tangible
