// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The linear system that a contact problem is once the mode of each contact is known.
//
//   K [v; y; λ] = [p; b; −c],     K = [ M  −Aᵀ  −Bᵀ
//                                       A   δ    0
//                                       C   0    δ  ]
//
// C has the rows n (closed contacts) and t (sticking ones); B the directions in which impulses act:
// n − σ μ t for a sliding contact, so that K is unsymmetric there and the adjoint needs Kᵀ. A step
// is solved with this system, and differentiated with the same factorisation. A driven contact
// (contact_problem.h) has λn = o in place of its row n; its impulse acts as others do.
//
// δ regularises redundant rows (four legs on a floor, a closed loop of bars): 1e-10 of the row's
// own r M⁻¹ rᵀ, on contacts and, where joints form loops, on joints. Solutions are refined against
// the K without δ, so what remains of δ is only the choice among redundant impulses.
//
// Where several contacts are closed they are taken out before factorisation
// (contact_condensation.h). Where refinement then stalls, the whole system is factorised instead.
//
// Beside a mass far greater δ is none of little: a body of 1 kg between the floor and 1e12 kg moves
// as if it were free by 1 / kg, but with both held by 1e-12 / kg, of which δ is the hundredfold. A
// round of refinement then takes 1 % of what is left in that direction, and all of the others;
// directions so slow are as few as such bodies, and conjugate residuals take one a round.

#include <algorithm>
#include <cmath>
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
  /// How often a condensed system did not refine, or was singular, and was factorised as a whole,
  /// since the start.
  int expansions() const { return expansions_; }
  /// In how many proximal steps redundant rows contradicted each other, to rounding or more, so
  /// that δ stood for them, since the start.
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
  /// Whether solves need the problem: they are refined against K without δ, as the factorisation
  /// found when it was made. Else they read the factors alone, and the problem may be any.
  bool needs_problem() const { return regularised_ || masses_differ_; }
  /// Exchanges what is known of the pattern of the system; it must be factorised anew before it
  /// solves.
  void SwapPattern(std::shared_ptr<BlockLuPattern>* pattern) { lu_.SwapPattern(pattern); }
  /// Hands the factorisation over (a tape keeps it); this object must be factorised anew before it
  /// solves.
  void MoveFactorsTo(ContactSystem* other);

  /// x := K⁻¹ x or K⁻ᵀ x; x row-major of shape (3 num_blocks, columns). Returns the largest
  /// residual left, relative to the magnitude of its kind of row. Unused rows stay 0.
  double Solve(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
               double* x, int columns);
  double SolveTransposed(const ContactProblem<double>& problem,
                         const std::vector<ContactMode>& modes, double* x, int columns);

  /// x := (K with δ)⁻¹ x, refined: the proximal step, which redundant rows that contradict each
  /// other do not upset. Returns as Solve does.
  double SolveRegularised(const ContactProblem<double>& problem,
                          const std::vector<ContactMode>& modes, double* x, int columns);
  /// The proximal step, and further ones as long as each lessens what δ left of the residual by
  /// half: the solution of K without δ where there is one, the regularised one where redundant rows
  /// contradict each other. Returns as Solve does.
  double SolveProximal(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                       double* x, int columns);
  /// δ of every row, 3 num_blocks; 0 but on rows of closed contacts and of joints in loops.
  const std::vector<double>& regularisation() const { return regularisation_; }

  /// residual := rhs − K x (Kᵀ x if transposed) without δ; returns as Solve does.
  template <bool kTransposed>
  double Residual(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                  const double* rhs, const double* x, int columns, double* residual) const;

 private:
  enum class Regularisation { kLeftOut, kKept };
  // Largest magnitudes of a kind of row: of its terms and of what is left.
  struct RowScale {
    double terms = 0.0;
    // Of the products that a constraint's value sums, and of the free motion: at rest all terms
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
  // Of a column, or of all. Its largest entry is relative to the terms of its kind of row, or to
  // the products that these sum.
  struct ResidualSize {
    RowScale momentum, constraint;
    void Include(const ResidualSize& other);
    double ToTerms() const { return std::max(momentum.Relative(), constraint.Relative()); }
    double ToParts() const {
      return std::max(momentum.RelativeToParts(), constraint.RelativeToParts());
    }
  };
  template <bool kTransposed>
  class ColumnResidual;
  // Momenta of the motion without constraints, whose speeds are of the size that rows cancel from:
  // row-major, 3 num_bodies rows; of each column, or one for all.
  struct FreeMomenta {
    const double* values;
    int columns;
  };
  // Writes the size of each column's residual where `sizes` is given; returns that of all.
  template <bool kTransposed>
  ResidualSize ResidualWith(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, Regularisation regularisation,
                            const FreeMomenta& free, const double* rhs, const double* x,
                            int columns, double* residual, ResidualSize* sizes) const;
  template <bool kTransposed>
  double Refine(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                Regularisation regularisation, const FreeMomenta& free, double* x, int columns,
                double goal);
  // Refines a column further by conjugate residuals; Scratch() has its residual.
  template <bool kTransposed>
  void RefineConjugate(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                       Regularisation regularisation, const FreeMomenta& free, double* x,
                       int columns, int column);
  bool FactorAs(bool condensed, const ContactProblem<double>& problem,
                const std::vector<ContactMode>& modes);
  // Whether the whole system could be factorised in place of the condensed one, where refinement
  // with that left this much.
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

  // Of refinement, one a thread: systems that a tape keeps are many.
  struct RefinementScratch {
    std::vector<ResidualSize> sizes, next_sizes;  // of columns
    std::vector<char> refined;                    // whether a column is done
    std::vector<double> conjugate;
  };
  static RefinementScratch& Scratch();

  BlockLu<double> lu_;
  std::vector<std::pair<int, int>> edges_;
  std::vector<int> contact_block_;
  int num_blocks_ = 0;
  int first_contact_edge_ = 0;
  bool regularised_ = false;
  bool masses_differ_ = false;  // so much that solves are refined
  bool condensed_ = false;
  int expansions_ = 0;
  int regularised_steps_ = 0;
  double fraction_ = kContactRegularisation;
  std::vector<double> regularisation_;
  std::vector<double> rhs_, correction_, last_;
  std::vector<Turning> turning_;
};

/// r M⁻¹ rᵀ with the diagonal of M: what a unit impulse along the row changes its speed by, were
/// its bodies free.
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

}  // namespace tangible
