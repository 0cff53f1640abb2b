// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The portfolio for contact problems: guess by contact modes, then pivoting, then interior point.
//
// 1. With modes given the problem is one linear system (contact_system.h). Its solution is exact
//    where it satisfies every inequality. Modes that are contradicted are changed and the system is
//    solved again, as long as fewer are contradicted from round to round. Where rows are redundant
//    each solve is a proximal step from the last impulses, which change as little as the data
//    require; where the motion depends on which they are, it is one from impulses of 0.
// 2. Where there are many contacts, a descent from the guess (contact_descent.h), which changes
//    many modes at a time, and pivoting (contact_pivoting.h) from where it ends; then pivoting from
//    the guess. Both have a bounded number of pivots: they search among the impulses of redundant
//    rows where modes are nearly right. All count as part of the guess.
// 3. Mehrotra's interior point (contact_interior_point.h), and pivoting from its modes where
//    margins are too small to read the modes from it.
// 4. Pivoting from all contacts open; for problems that are not proved infeasible pivoting from
//    random starts (contact_restarts.cc); for problems that are not large the dense portfolio.
//    Lemke's method on the dense one-sided form runs only if the options ask for it.
//
// After 3 and 4 the modes are identified and the mode system is solved once more: the polish. A
// solution is accepted only by its scaled natural residual, recomputed from the data.
//
// Pivoting ends in proximal steps with δ falling from 1e-7 to 1e-8. A residual that then remains
// and no longer falls means that rows contradict each other, and only the limits of impulses can
// decide between them: the impulses are extrapolated along their last change until one reaches its
// limit.

#include <limits>
#include <vector>

#include "tangible/lcp/contact/contact_descent.h"
#include "tangible/lcp/contact/contact_interior_point.h"
#include "tangible/lcp/contact/contact_pivoting.h"
#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/dense/solver_choice.h"
#include "tangible/lcp/dense/tolerances.h"
#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/lcp/system/contact_system.h"
#include "tangible/lcp/system/mode_solve.h"

namespace tangible {

/// The part of the portfolio that solved a problem, in the order in which they are tried.
enum class Rung : unsigned char {
  kNone,
  kDirect,                     ///< no contacts: one linear system
  kModeChanges,                ///< the guess's modes, changed where they are contradicted
  kDescent,                    ///< sweeps and subspace solves from the guess
  kPivotingFromDescent,        ///< pivots from where these end
  kPivotingFromGuess,          ///< pivots from the guess
  kInteriorPoint,              ///< the interior point, polished
  kPivotingFromInteriorPoint,  ///< pivots from its modes
  kPivotingFromOpen,           ///< pivots from all contacts open
  kRestarts,                   ///< pivots from random starts
  kDense,                      ///< the dense portfolio
  kLemke                       ///< Lemke's method on the dense form, where it is asked for
};
inline constexpr size_t kNumRungs = static_cast<size_t>(Rung::kLemke) + 1;

/// "pivoting_from_guess", ...; "none".
const char* NameOf(Rung rung);

struct ContactSolverOptions {
  SolverChoice choice = SolverChoice::kAuto;
  double tolerance = kLcpTolerance;  ///< largest scaled natural residual
  int max_iterations = 100;          ///< limit of iterations of the interior point
  /// Whether restarts, and further attempts of the dense portfolio, follow all else. They take most
  /// of a second, and few problems need them.
  bool last_resort = true;
};

/// Counts of the methods that were needed beyond changes of the guess's modes. A method that the
/// options ask for does not count.
struct ContactFallbacks {
  long pivoting = 0;          ///< paths of pivots from the guess or from the interior point's modes
  long interior_point = 0;    ///< runs of the interior point
  long lemke = 0;             ///< paths of pivots from all contacts open, Lemke's method
  long dense = 0;             ///< the dense portfolio
  long restarts = 0;          ///< paths of pivots from many random starts
  long extrapolation = 0;     ///< extrapolations of impulses of contradictory rows
  long regularised = 0;       ///< proximal steps in which δ stands for redundant rows
  long whole_system = 0;      ///< condensed systems that were factorised as a whole instead
  long islands_together = 0;  ///< islands that could not be solved separately

  void Add(const ContactFallbacks& other);
};

struct ContactSolverReport {
  bool solved = false;
  Rung rung = Rung::kNone;
  int factorisations = 0;  ///< number of factorised mode systems
  int iterations = 0;      ///< number of iterations of the interior point or Lemke
  double residual = 0.0;   ///< scaled natural residual
  int worst_contact = -1;  ///< where it is largest, −1: an equation
  ContactFallbacks fallbacks;
};

class ContactSolver {
 public:
  /// `solution` holds the guess on entry (modes and impulses, sized for the problem) and the
  /// solution on return.
  ContactSolverReport Solve(const ContactProblem<double>& problem,
                            const ContactSolverOptions& options, ContactSolution<double>* solution);
  /// The mode system of the last solution, factorised with its modes.
  ContactSystem& system() { return system_; }
  void Reserve(int num_bodies, int num_joints, int num_contacts);

 private:
  // Problems with rolling friction (contact_rolling.cc).
  ContactSolverReport SolveRolling(const ContactProblem<double>& problem,
                                   const ContactSolverOptions& options,
                                   ContactSolution<double>* solution);
  // Starts rolled_ and whole_ from a solution for given limits.
  void StartWhole(const ContactProblem<double>& problem, const ContactSolution<double>& solution);
  // Whether the modes of rolled_, or modes near them, solve the problem itself.
  bool SettleWhole(const ContactSolverOptions& options, ContactSolution<double>* solution,
                   ContactSolverReport* report);
  bool PivotWhole(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                  ContactPivoting::From from, ContactSolution<double>* solution,
                  ContactSolverReport* report);
  // Changes modes that rolled_ contradicts; whether there were any.
  bool ChangeRollingModes(const ContactSolverOptions& options);
  ContactSolverReport RunPortfolio(const ContactProblem<double>& problem,
                                   const ContactSolverOptions& options,
                                   ContactSolution<double>* solution);
  // The proximal step from the centre's impulses with the solution's modes.
  bool SolveWithModes(const ContactProblem<double>& problem, ContactSolution<double>* solution,
                      ContactSolverReport* report,
                      int most_beyond = std::numeric_limits<int>::max());
  void SetCentre(const ContactSolution<double>& solution);
  // Where contacts squeeze a body by more than its load, and friction slows or holds it by that,
  // takes a solution with less impulses, where one is found.
  void ReleaseSqueeze(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                      ContactSolution<double>* solution, ContactSolverReport* report);
  // False at once where more than `most_beyond` impulses are plainly beyond their limits in the
  // solution of the given modes.
  bool SolveByModeChanges(const ContactProblem<double>& problem,
                          const ContactSolverOptions& options, ContactSolution<double>* solution,
                          ContactSolverReport* report,
                          int most_beyond = std::numeric_limits<int>::max());
  // A descent, then pivots from where it ends.
  bool SolveByDescent(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                      ContactSolution<double>* solution, ContactSolverReport* report);
  bool SolveByInteriorPoint(const ContactProblem<double>& problem,
                            const ContactSolverOptions& options, ContactSolution<double>* solution,
                            ContactSolverReport* report);
  bool SolveByLemke(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                    ContactSolution<double>* solution, ContactSolverReport* report);
  // Used where a method ends without any iterate: the motion without contact impulses replaces it,
  // so that the report names a contact that is violated and by how much.
  void MeasureWithoutContacts(const ContactProblem<double>& problem,
                              ContactSolution<double>* solution, ContactSolverReport* report);
  bool SolveByPivoting(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                       ContactPivoting::From from, int max_pivots, int max_rounds,
                       ContactSolution<double>* solution, ContactSolverReport* report);
  // Pivoting from random modes and over random shifts (contact_restarts.cc), unless the problem is
  // proved to have no solution.
  bool SolveByRestarts(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                       ContactSolution<double>* solution, ContactSolverReport* report);
  bool Polish(const ContactProblem<double>& problem, const ContactSolverOptions& options,
              ContactSolution<double>* solution, ContactSolverReport* report);

  ContactSystem system_;
  ContactDescent descent_;
  ContactPivoting pivoting_;
  InteriorPointWorkspace<double> interior_point_;
  ModeSolve mode_solve_;
  ContactSolution<double> trial_, entry_, last_;
  ContactSolution<double> centre_;  ///< only the impulses are used
  std::vector<int> changes_;
  ContactScales scales_;
  ContactProblem<double> given_, whole_;  ///< with rolling friction
  ContactSolution<double> rolled_;
  std::vector<double> loads_;
};

/// Whether the problem is small enough for the dense portfolio: up to 240 rows of the one-sided
/// form (4 for each contact with friction, else 1), and 1000 unknowns of bodies and joints.
bool FitsDensePortfolio(const ContactProblem<double>& problem);

/// The dense portfolio (solver.h) on the one-sided form, with its further attempts where they are
/// the last resort; false where it fails or does not fit.
bool SolveContactsDense(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                        ContactSolution<double>* solution, int* iterations);

/// Whether a checked Farkas vector says that no impulses satisfy the contacts' inequalities; false
/// too where the problem has more than 400 rows or 1000 unknowns.
bool ContactsProvedInfeasible(const ContactProblem<double>& problem);

/// Lemke's method on the dense one-sided form of the problem; false where it fails, or the problem
/// has more than 400 rows or 1000 unknowns.
bool SolveContactsByLemke(const ContactProblem<double>& problem, ContactSolution<double>* solution,
                          int* iterations);

}  // namespace tangible
