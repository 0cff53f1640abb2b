// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// One fixed step: the contact problem of [t, t + h] is solved for the new twist, then poses move
// with it.
//
//   v⁺ from the contact problem at q (assembly.h),   q⁺ = q + h v⁺      semi-implicit Euler
//   with joint_correction "projection": q⁺ is then projected onto the joints
//
// The step in double keeps a record from which the derivative is taken: tangent and adjoint use the
// factorisation that the solve ended with. Two ways for Jets:
//   implicit   the double step's modes and solution, and K⁻¹ applied to the Jets' residual
//   unrolled   every operation of the interior point in Jets, from the same contacts
// After its first call a step in double allocates memory only if it has more contacts than before.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tangible/dynamics/assembly/contact_search.h"
#include "tangible/lcp/contact/contact_inner_impulses.h"
#include "tangible/lcp/contact/contact_islands.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/simulation/events/support_iteration.h"
#include "tangible/simulation/islands/island_derivative.h"
#include "tangible/simulation/islands/island_jets.h"
#include "tangible/simulation/islands/island_step.h"
#include "tangible/simulation/stepping/joint_projection.h"

namespace tangible {

/// What a step uses of earlier steps besides the state: modes and impulses to start from.
struct StepperGuess {
  std::vector<ActiveContact> contacts;
  ContactSolution<double> solution;  ///< without v
  EventGuess events;                 ///< event stepping: the only one used

  size_t bytes() const;
};

/// What the adjoint of a step needs.
struct StepTape {
  StepRecord record;
  ContactSystem system;
  std::unique_ptr<JointProjection> projection;  ///< where the scene asks for it
  IslandRecords parts;  ///< event stepping: the step, in place of all of the above
  bool has_factors = false;

  /// Memory, also of the factors alone; they include the problem, which their solves may need.
  size_t bytes() const;
  size_t factor_bytes() const { return system.bytes() + record.problem.bytes(); }
  void DropFactors();
};

class Stepper {
 public:
  /// `threads` solve a step's islands; the bits are the same for any number.
  explicit Stepper(const Model<double>& model, int threads = 1);

  /// Advances the state from t by h. The parameters of `model` may differ from call to call, its
  /// structure may not.
  StepReport Step(const Model<double>& model, double t, double h, State<double>* state);

  /// The record of the last step. With event stepping: its contacts, with the sums of their
  /// impulses and their modes at the end.
  const StepRecord& record() const { return record_; }
  /// Whether steps are event steps, which parts() hold; derivatives use them.
  bool by_events() const { return events_ != nullptr; }
  /// The parts of the last event step; none by fixed steps.
  const IslandRecords& parts() const { return events_ ? events_->record() : no_parts_; }
  IslandRecords& mutable_parts() { return events_ ? events_->mutable_record() : no_parts_; }
  /// The derivative of one island of an event step.
  EventDerivative& event_derivative() { return event_derivative_.of_island(); }
  /// Among the last step's impulses, which redundant contacts may share in many ways, chooses a
  /// share with the fewest contacts at a limit (contact_inner_impulses.h); the motion keeps its
  /// bits, and so does the next step. Derivatives use it: call it before record() and system().
  /// Nothing by events.
  void ChooseImpulses();
  /// The mode system, factorised with the last step's modes.
  ContactSystem& system();
  JointProjection& projection() { return projection_; }

  /// The tangent of the last step: w_dot, num_variables x columns, of the state before it on entry
  /// and after it on return. `fixed`: 1 for a variable that no column varies; empty: unknown.
  /// Returns the largest relative residual of the linear solves.
  double Tangent(const Model<double>& model, const std::vector<char>& fixed, RowMatrixXd* w_dot,
                 const SolveObserver& observer = {});
  /// Turns the derivatives of the new twists of moving blocks (3 num_blocks x columns, row-major)
  /// into those of the state after a fixed step: poses move with the twists, and are projected.
  void AdvanceTangent(const Model<double>& model, const double* twists, RowMatrixXd* w_dot);
  /// Moves to a tape what the adjoint of the last step needs, with the factorisation if it is to be
  /// kept. Until the next step the stepper's record is not valid.
  void Take(const Model<double>& model, bool keep_factors, StepTape* tape);
  /// The adjoint of a step on a tape: w_bar, num_variables x columns, of the state after it on
  /// entry and before it on return. A step without factors is assembled and factorised anew.
  void Adjoint(const Model<double>& model, StepTape* tape, RowMatrixXd* w_bar);

  /// Forgets the last step's modes and impulses: the next step starts without a guess.
  void ClearGuess();
  /// Sets the guess to that of a recorded step, so that a run can be resumed with the same bits.
  void SetGuess(const StepRecord& record);
  /// Saves the guess of the next step, and restores it: from the same state the step then gives the
  /// same bits.
  void SaveGuess(StepperGuess* guess) const;
  void SetGuess(const StepperGuess& guess);

 private:
  // Assembles and factorises a recorded step anew in system(); its problem is filled in.
  void Refactor(const Model<double>& model, StepRecord* record);
  void SolveAdjoint(const Model<double>& model, StepTape* tape, ContactSystem* system,
                    RowMatrixXd* w_bar);
  StepReport StepByEvents(const Model<double>& model, double t, double h, State<double>* state);
  void SumImpulses(const Model<double>& model);
  enum class Guess { kLastStep, kSameStep };
  // Sets the modes and impulses from which this problem's solution is sought: those of `solution`
  // for the contacts that both have.
  void CarryGuess(const std::vector<ActiveContact>& contacts,
                  const ContactSolution<double>& solution, Guess from_where);
  ContactSolverReport SolveContacts(const ContactSolverOptions& options, int* islands);
  // Finds the contacts that the step may close and solves with them; again with more contacts where
  // bodies turn out faster than was assumed.
  // `from`: the modes of the last step, or of wider_contacts_ with narrow_solution_.
  ContactSolverReport SolveWithContacts(const Model<double>& model, const State<double>& state,
                                        double h, Guess from, StepReport* report);
  // The same for a scene with supports, again until their friction is that of the new twists.
  ContactSolverReport SolveWithSupports(const Model<double>& model, const State<double>& state,
                                        double h, StepReport* report);
  ContactMode InitialMode(const ContactBlock<double>& contact) const;
  void FillReport(const Model<double>& model, const ContactSolverReport& solved,
                  StepReport* report);
  void Describe(const Model<double>& model, int contact, StepReport* report) const;
  // Closes the contacts at rest that carried an impulse in the last step and carry none in this.
  // That step stopped whatever approached, so that a derivative in which this one is open would let
  // a body go that a wall has stopped.
  void KeepHeld();

  std::unique_ptr<IslandStepper> events_;  ///< event stepping only
  IslandDerivative event_derivative_;
  IslandRecords no_parts_;
  SolveDerivative solve_derivative_;
  ContactProblem<double> refactored_;  ///< memory of the problem that is assembled anew
  ContactSearch search_;
  SupportIteration supports_;
  ContactSolver solver_;
  std::unique_ptr<IslandSolver> islands_;
  bool factored_ = true;  ///< whether solver_.system() is that of record_
  bool chosen_ = true;    ///< whether ChooseImpulses was done for record_
  InnerImpulses inner_impulses_;
  JointProjection projection_;
  AssemblyScratch<double> scratch_;
  StepRecord record_;
  // The last step's contacts and impulses: the guess.
  std::vector<ActiveContact> last_contacts_;
  ContactSolution<double> last_solution_;
  std::vector<ActiveContact> wider_contacts_;  // of a wider or (swapped) narrower search
  ContactSolution<double> narrow_solution_;
  std::vector<CoefficientSource> wider_friction_, wider_restitution_;
  std::vector<Turning> turning_;  // scratch
  // The modes in the last step of this step's contacts that carried an impulse there; else open.
  std::vector<ContactMode> held_;
};

/// The step in Jets that `stepper` has just done in double, from the state's values to `after`; the
/// numbers of `values` are those of `model`. False where the interior point of an unrolled step
/// fails and the implicit derivative is given instead.
template <typename T>
bool StepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                const State<double>& after, Stepper* stepper, State<T>* state);

/// Number of steps: ceil(duration / dt − kSameTime).
long NumSteps(const SimulationSettings& settings);
/// Time of step k: min(k dt, duration), never accumulated.
double StepTime(const SimulationSettings& settings, long k);
/// Length of step k: dt, except for the last.
double StepLength(const SimulationSettings& settings, long k);
/// Makes steps end at further times within the run; times within kSameTime dt of another are the
/// same.
void AddStepTimes(const std::vector<double>& times, SimulationSettings* settings);

}  // namespace tangible
