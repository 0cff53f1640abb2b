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

#include <memory>
#include <string>
#include <vector>

#include "tangible/dynamics/assembly/contact_search.h"
#include "tangible/lcp/contact/contact_inner_impulses.h"
#include "tangible/lcp/contact/contact_islands.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/simulation/islands/island_derivative.h"
#include "tangible/simulation/islands/island_step.h"
#include "tangible/simulation/stepping/joint_projection.h"

namespace tangible {

/// Of a step or a run. kRefused: a parameter has a value that is not allowed; nothing was run.
enum class StepStatus { kDone, kUnsolved, kDiverged, kRefused };

/// "done", "unsolved", "diverged", "refused".
const char* NameOf(StepStatus status);

/// The report of a step; the caller sums over the run.
struct StepReport : StepCounts {
  StepStatus status = StepStatus::kDone;
  int closed = 0;        ///< contacts with an impulse
  int islands = 0;       ///< with contacts, or by events, solved apart; 0: all is one
  double gap_min = 0.0;  ///< m, the smallest at the start; infinite where no contact is near
  std::string message;   ///< empty unless it failed: names the contact or joint
};

/// What a step uses of earlier steps besides the state: modes and impulses to start from.
struct StepperGuess {
  std::vector<ActiveContact> contacts;
  ContactSolution<double> solution;  ///< without v
  EventGuess events;                 ///< event stepping: the only one used

  size_t bytes() const;
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
  /// Whether steps are event steps; then events() made the last one, and derivatives use its
  /// record.
  bool by_events() const { return events_ != nullptr; }
  IslandStepper& events() { return *events_; }
  IslandDerivative& event_derivative() { return event_derivative_; }
  /// Among the last step's impulses, which redundant contacts may share in many ways, chooses a
  /// share with the fewest contacts at a limit (contact_inner_impulses.h); the motion keeps its
  /// bits, and so does the next step. Derivatives use it: call it before record() and system().
  /// Nothing by events.
  void ChooseImpulses();
  /// The mode system, factorised with the last step's modes.
  ContactSystem& system();
  JointProjection& projection() { return projection_; }
  /// Moves the last step's record and, unless null, its factorisation to the arguments; a tape uses
  /// this to avoid copies. Until the next step record() and system() are not valid. The record's
  /// problem is moved only where the solves of the factorisation need it.
  void TakeRecord(StepRecord* record, ContactSystem* system);
  /// Assembles and factorises a recorded step anew, so that system() is that step's; its problem is
  /// filled in.
  bool Refactor(const Model<double>& model, StepRecord* record);

  /// Forgets the last step's modes and impulses: the next step starts without a guess.
  void ClearGuess();
  /// Sets the guess to that of a recorded step, so that a run can be resumed with the same bits.
  void SetGuess(const StepRecord& record);
  /// Saves the guess of the next step, and restores it: from the same state the step then gives the
  /// same bits.
  void SaveGuess(StepperGuess* guess) const;
  void SetGuess(const StepperGuess& guess);

 private:
  StepReport StepByEvents(const Model<double>& model, double t, double h, State<double>* state);
  void SumImpulses(const Model<double>& model);
  enum class Guess { kLastStep, kSameStep };
  // Sets the modes and impulses from which this problem's solution is sought: those of `solution`
  // for the contacts that both have.
  void CarryGuess(const Model<double>& model, const std::vector<ActiveContact>& contacts,
                  const ContactSolution<double>& solution, Guess from_where);
  ContactSolverReport SolveContacts(const ContactSolverOptions& options, int* islands);
  // Finds the contacts that the step may close and solves with them; again with more contacts where
  // bodies turn out faster than was assumed.
  ContactSolverReport SolveWithContacts(const Model<double>& model, const State<double>& state,
                                        double h, StepReport* report);
  ContactMode InitialMode(const ContactBlock<double>& contact) const;
  void FillReport(const Model<double>& model, const ContactSolverReport& solved,
                  StepReport* report);
  void Describe(const Model<double>& model, int contact, StepReport* report) const;

  std::unique_ptr<IslandStepper> events_;  ///< event stepping only
  IslandDerivative event_derivative_;
  ContactSearch search_;
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
};

/// The implicit derivative part of a step in Jets: `stepper` has just done the same step in double;
/// model and state are the Jets whose values that step had. Returns the state after.
template <typename T>
void StepImplicit(const Model<T>& model, Stepper* stepper, const State<double>& after,
                  State<T>* state);

/// The unrolled step in Jets, with the contacts of the double step; false where the interior point
/// fails.
template <typename T>
bool StepUnrolled(const Model<T>& model, const StepRecord& record, State<T>* state);

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
