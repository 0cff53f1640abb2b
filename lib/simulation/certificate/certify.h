// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The certificate of a rollout's derivative: how near its steps are to kinks and jumps.
//
//   margins        of every contact and limit of every step, by its mode (MarginOfContact);
//                  also of the choice between the constants gap / h, −recovery_speed and e (n·v)
//                  where these are continuous, and of the choice of the corners and edges that
//                  touch (feature_ties.h)
//   jumps          the restitution decisions (contact.h): the smallest relative
//                  |approach speed − threshold| and |gap + h n·v_free − margin| of contacts with
//                  e > 0; and a landing in the last step, whose twist has derivatives of order 1/h
//                  that the next step would cancel
//   energy         that has grown by events though nothing drives the scene: motions were too long
//                  for the integrator; counts as a jump (energy_watch.h)
//   one-sided      friction exactly 0, of a contact, its rolling, a joint, a motor or a support (no
//                  damping, stiffness or drag of 0: its law goes on below 0), equal coefficients in
//                  the mixing rule, an edge of a force's window at the start or the end of the run,
//                  or with fixed stepping on any step's boundary: only where derivatives with
//                  respect to these numbers are wanted; and with event stepping a contact that
//                  touches as the run starts, where a direction opens or closes its gap: on one
//                  side the body falls and lands, on the other it is pushed out
//   controls       an event at the boundary of two steps whose controls differ: different forces
//                  act before and after it, and its derivative differs on each side
//   loads          by events, a slip that ends or an impact as a load on its bodies jumps: a
//                  force's window, a signal, the end of a joint, a path's rate
//   split          by events, an event on the end of a step, where the motion before or behind it
//                  has an integrator's error: beside it the event splits one step or the other
//   end            by events, an event at the last instant of the run: beside it the event has
//                  happened or not, so that a twist jumps (a touch) or has another derivative (an
//                  end of sliding)
//   coordinates    so large that their rounding exceeds kLargeCoordinates of the size of a body
//                  that has contacts or joints (coordinate_watch.h): its modes may be determined by
//                  rounding
//   discrete map   by fixed steps, where a restitution acted or a contact was made or broken
//                  (discrete_map.h)
//   linear systems redundant rows, condition, residual (contact_conditioning.h), of every step

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tangible/lcp/certificate/certificate.h"
#include "tangible/simulation/certificate/contact_coupling.h"
#include "tangible/simulation/certificate/discrete_map.h"
#include "tangible/simulation/stepping/coordinate_watch.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

/// A state during the run that is an output too: that of a body after so many steps, −1: of all.
struct StateRead {
  long steps = 0;
  int body = -1;
};

struct CertifyOptions {
  /// Indices of the model's numbers with respect to which derivatives are taken, ascending.
  std::vector<int> numbers;
  /// The directions of [initial poses | initial twists | parameters] along which derivatives are
  /// taken, one in each column, and their names.
  RowMatrixXd directions;
  std::vector<std::string> names;
  /// Beside the state at the end; with their twists.
  std::vector<StateRead> reads;
};

/// Two bodies near a change of the corners and edges of their contact, before a fixed step.
struct FeatureTie {
  long step = 0;
  int a = -1, b = -1;
};

/// Collects the certificate step by step.
class RolloutCertifier {
 public:
  explicit RolloutCertifier(CertifyOptions options = {});

  /// The step that the stepper has just done; `step` counts from 0.
  void AddStep(const Model<double>& model, long step, Stepper* stepper);
  /// Adds the events of the same step that coincide with a change of the controls.
  void AddControls(const ModelStructure& structure, const Controls& controls, long step,
                   Stepper* stepper);
  /// The certificate with its verdict, after the last step.
  Certificate Finish(const Model<double>& model, const RolloutReport& report);
  /// Smallest margin of the last step that was added; infinite if nothing was near.
  double step_margin() const { return step_margin_; }
  /// After Finish: leaves out of a certificate the contacts that are exactly at a kink, fixed steps
  /// only. For directions that move none of them.
  void LeaveOutKinks(Certificate* certificate) const;
  /// Leaves out changes of corners and edges, by fixed steps, that no direction moves; whether
  /// there are such alone.
  bool LeaveOutFeatures(const Model<double>& model, const State<double>& initial,
                        Certificate* certificate) const;

 private:
  struct Place;
  enum class AtKink { kNo, kYes, kOfFeatures };
  void AddMargin(double margin, const Place& place, const std::string& what,
                 AtKink at_kink = AtKink::kNo);
  void AddJump(double margin, const Place& place, const std::string& what);
  void AddServos(const Model<double>& model, long step, const StepRecord& record);
  void AddServosOnBound(const Model<double>& model, long step, const Segment& segment);
  void AddSupports(const Model<double>& model, long step, const StepRecord& record);
  void AddSupportsWithoutFriction(const Model<double>& model, const StepRecord& first);
  /// Springs with a rest length whose ends pass through each other.
  void AddSprings(const Model<double>& model, double time, const State<double>& before,
                  const State<double>& after);
  void AddDiscreteMap(const Model<double>& model, long step, const StepRecord& record);
  /// Of a body at rest whose load moves it in the first step: set off against it, it has the
  /// friction of the other direction first. Empty where no direction changes its speed there.
  std::string SetOffAtStart(const Model<double>& model, const StepRecord& record) const;
  /// An edge of a force's window, as a parameter, within a step in which friction lets go: it acts
  /// against the part that the force has of the step, where in the motion it does so from the edge
  /// on. Empty where there is none.
  std::string EdgeThatLetsGo(const Model<double>& model, long step, const StepRecord& record);
  void AddEventStep(const Model<double>& model, long step, Stepper* stepper);
  void AddIsland(const Model<double>& model, long step, EventDerivative* derivative,
                 IslandRecord* island);
  void EnterIsland(const ModelStructure& whole, const IslandRecord& island);
  void LeaveIsland(const IslandRecord& island);
  void AddStart(const Model<double>& model, const EventRecord& record);
  void ProbeStarts(const Model<double>& model, const State<double>& start,
                   const std::vector<const ActiveContact*>& touching, const Segment* first);
  /// Whether friction that is at rest as a segment starts, and slides at once, keeps its direction:
  /// at an instant after an event, which has decided it; and as the run starts where no direction
  /// of the parameters changes the rate of the contact or joint, or the twists of other bodies that
  /// joints transmit.
  bool KeepsSide(const Model<double>& model, const ActiveContact& contact,
                 EventDerivative* derivative, Segment* segment) const;
  bool LeavesLimitAtStart(const Model<double>& model, const Segment& motion, size_t contact,
                          EventDerivative* derivative) const;
  bool SlidesAtLimit(const Model<double>& model, ContactMode by_share, size_t contact,
                     EventDerivative* derivative, Segment* segment) const;
  void AddOrder(const Model<double>& model, const Segment& segment);
  void AddSplits(const Model<double>& model, long step, const Segment& segment);
  void AddImpact(const Model<double>& model, long step, Impulses* impact);
  void AddOtherSlips(const Model<double>& model, const Segment& segment, const Place& place);
  void KeepEndsOfSlips(const Model<double>& model, const Segment& segment);
  void AddJumpsOfLoads(const Model<double>& model, const Segment& segment, const Place& place);
  void AddBesideJumps(const Model<double>& model, const Segment& segment);
  void AddEventOf(const Model<double>& model, long step, EventDerivative* derivative,
                  Segment* segment);
  void AddStoppedDead(const Model<double>& model, long step, const Segment& segment);
  void AddSegment(const Model<double>& model, long step, EventDerivative* derivative,
                  Segment* segment);
  void AddHeldSupports(const Model<double>& model, long step, const Segment& segment);
  void AddFriction(const CoefficientSource& friction, const Place& place);
  void AddEnd(const Model<double>& model, long step, const EventRecord& record);
  /// The reads after so many steps.
  std::span<const StateRead> ReadsAfter(long steps) const;
  /// Whether the state after so many steps is an output; `time`: at that instant.
  bool IsRead(const ModelStructure& structure, long steps) const;
  bool IsReadAt(const ModelStructure& structure, double time) const;
  /// What is said of an event as the run ends, or a state is read.
  std::string AsRead(const ModelStructure& structure, long steps, const char* event) const;
  /// Whether a body of the contact is one whose state is read, or may move it by a joint.
  bool MovesRead(const ModelStructure& structure, long steps, const ActiveContact& contact) const;
  void AddSupportsAtStart(const Model<double>& model, const Segment& first);
  void AddHandOversAtStart(const Model<double>& model, const State<double>& start,
                           const std::vector<const ActiveContact*>& touching);
  void AddHandOversAtEnd(const Model<double>& model, long step, const Segment& last);
  void AddTouchesAtEnd(const Model<double>& model, long step, const Segment& last);
  void AddTouchBehind(const Model<double>& model, long step, const Segment& last,
                      const ActiveContact& contact, const std::string& what);
  /// A contact over a flush corner whose points are parameters, where the derivative by them is
  /// that of the edge on one side.
  void AddFlushCorner(const Model<double>& model, const State<double>& state,
                      const ActiveContact& contact, double time);
  void AddFacesAcross(const Model<double>& model, const State<double>& state,
                      const std::vector<ActiveContact>& contacts,
                      const std::vector<ContactMode>& modes, double time);
  void AddLimitsAtRelease(const Model<double>& model, long step, const Segment& segment);
  void AddClosedAtOnce(const Model<double>& model, long step, const Segment& segment);
  void AddTwoLimits(const Model<double>& model, long step, const Segment& segment);
  void AddQuality(const ModelStructure& s, const ContactProblem<double>& problem,
                  const std::vector<ContactMode>& modes,
                  const std::vector<CoefficientSource>& friction, ContactSystem* system);
  void AddRedundancy(const ModelStructure& s, const ContactProblem<double>& problem,
                     const std::vector<ContactMode>& modes,
                     const std::vector<CoefficientSource>& friction);
  void AddUnloaded(const Model<double>& model, long step, const Impulses& impact);
  bool StaysUnloaded(const Model<double>& model, const Impulses& impact, size_t i) const;
  void AddSimultaneous(const Model<double>& model, long step, const Impulses& impact);
  /// Whether a direction changes the gap of a contact at the run's start; or that, or its speed.
  bool MovesGap(const Model<double>& model, const State<double>& start,
                const ActiveContact& contact) const;
  bool MovesAtStart(const Model<double>& model, const State<double>& start,
                    const ActiveContact& contact) const;
  bool MovesAny(const std::vector<JacobianEntry>& gradient) const;
  double SinceLastStrike(const ModelStructure& s, const Impulses& impact,
                         const std::vector<size_t>& approaching) const;
  Coupling CouplingWithStrikes(const Model<double>& model, const Impulses& impact) const;
  void AddStrikes(const ModelStructure& s, const Impulses& impact);
  void AddEndsOfSlips(const Model<double>& model, long step, const Impulses& impact);
  void AddContact(const Model<double>& model, const StepRecord& record, const ContactScales& scales,
                  const Place& place);
  void AddLaw(const Model<double>& model, const StepRecord& record, const Place& place);
  void AddCoefficients(const StepRecord& record, const Place& place);
  void AddFeatures(const Model<double>& model, const StepRecord& record, long step,
                   ContactSystem* system);
  void AddLinearSystem(const Model<double>& model, const StepRecord& record, ContactSystem* system);
  void AddForceWindows(const Model<double>& model);
  void AddReleases(const Model<double>& model);
  void AddPaths(const Model<double>& model);
  bool ActsAtStart(const ModelStructure& s, int body) const;
  bool Wanted(int number) const;
  /// The directions of the variables of the island that is looked at.
  const RowMatrixXd& Directions() const {
    return island_ != nullptr ? own_directions_ : options_.directions;
  }
  void OneSided(const std::string& reason);

  CertifyOptions options_;
  Certificate certificate_;
  InnerImpulses inner_impulses_;
  std::optional<CoordinateWatch> coordinates_;    ///< from the first step on
  std::optional<DiscreteMapWatch> discrete_map_;  ///< from the first fixed step on
  std::vector<ActiveContact> held_last_;          ///< by friction, in the last step
  std::string made_last_;  ///< of the last step; empty if no contact was made in it
  double step_margin_ = std::numeric_limits<double>::infinity();
  double margin_beside_ = std::numeric_limits<double>::infinity();  ///< without contacts at a kink
  std::string beside_where_;
  double jump_margin_ = std::numeric_limits<double>::infinity();
  std::string jump_where_;
  std::string landing_;                ///< of the last step; empty if nothing landed in it
  std::string spring_turns_;           ///< of the first; empty: none
  std::vector<ActiveContact> closed_;  ///< of the last step, or segment
  /// What the system of the last fixed step depends on.
  struct LastSystem {
    std::vector<ContactMode> modes;
    std::vector<double> parameters, pose, twist;
    size_t dampers = 0;
    double h = 0.0;
    bool Repeats(const Model<double>& model, const StepRecord& record) const {
      return record.solution.modes == modes && record.h == h &&
             record.problem.dampers.size() == dampers && record.before.pose == pose &&
             record.before.twist == twist && model.parameters == parameters;
    }
    void Keep(const Model<double>& model, const StepRecord& record) {
      modes = record.solution.modes;
      parameters = model.parameters;
      pose = record.before.pose;
      twist = record.before.twist;
      dampers = record.problem.dampers.size();
      h = record.h;
    }
  };
  LastSystem last_;
  std::vector<FeatureTie> feature_ties_;  ///< by step
  double margin_but_features_ = std::numeric_limits<double>::infinity();
  std::string where_but_features_;
  int last_redundant_ = 0;
  // For event stepping: contacts that carry a force, the bodies that the last impact moved, and
  // when.
  std::string held_edge_;  ///< an edge of EdgeThatLetsGo in the last step, if it held then
  std::vector<ActiveContact> loaded_;
  std::vector<double> struck_at_;  ///< for each body: the time of its last impact, s
  /// A contact, of the whole model, of an impact at a time (s).
  struct Strike {
    ActiveContact contact;
    double time = 0.0;
  };
  /// Contacts of the whole model that the last motions held, until when; without those that their
  /// events opened or handed over.
  std::vector<Strike> held_;
  double missed_ = 0.0;              ///< by all motions until now (certify_grazing.h)
  std::vector<Strike> stuck_;        ///< the same of those that stuck as another one was lifted off
  std::vector<Strike> strikes_;      ///< of the last impact, and of those shortly before it
  std::vector<Strike> slips_ended_;  ///< of the last instant at which contacts stopped sliding
  const Impulses* impact_ = nullptr;  ///< the last one in a step, until the motion that follows it
  const Segment* start_ = nullptr;  ///< the instant at which the run starts, until the first motion
  /// A located event near a step's end, of contacts of the whole model.
  struct Boundary {
    ActiveContact contact;
    double distance = 0.0;  ///< steps
  };
  std::vector<Boundary> boundaries_;  ///< whose next motion is still to come
  bool edge_splits_ = false;          ///< an edge whose time is wanted is at a step's end, the same
  /// The same of an event at the instant at which a load on its bodies jumps.
  struct BesideJump {
    ActiveContact contact;
    double distance = 0.0;  ///< steps
    long step = 0;
    double time = 0.0;
    std::string what;
    bool is_touch = false;
    bool rebounds = false;  ///< an impact with a restitution
    bool of_joint = false;  ///< the end of a joint, whose bodies part where it comes first
  };
  std::vector<BesideJump> beside_jumps_;
  // The three of all islands, while closed_, loaded_ and struck_at_ are those of one.
  std::vector<ActiveContact> all_closed_, all_loaded_;
  /// Contacts that touch as the run starts; of fixed steps those that may close in the first one.
  std::vector<ActiveContact> touching_at_start_;
  std::vector<double> all_struck_at_;
  const IslandRecord* island_ = nullptr;  ///< whose bodies and numbers are looked at
  RowMatrixXd own_directions_;            ///< the directions of its variables
};

/// Runs the rollout and certifies it. A rollout that fails is certified up to the failure, which
/// `report` describes unless it is null.
Certificate CertifyRollout(const ControlledModel<double>& model, const State<double>& initial,
                           const CertifyOptions& options = {}, RolloutReport* report = nullptr);

/// The reason for a verdict `one-sided` where a direction contradicts redundant rows: one contact
/// would open or slip and the others not.
inline constexpr char kContradictingRows[] =
    "redundant contacts contradict the change of a parameter";

/// The reason where redundant contacts leave a motion undetermined (contact_conditioning.h).
inline constexpr char kUndeterminedMotion[] =
    "redundant contacts that slide with different friction leave the motion undetermined";

/// The reason where they leave the derivative by the friction of some of them undetermined.
inline constexpr char kUndeterminedFriction[] =
    "redundant contacts share their load in many ways, so that the derivative by the friction of "
    "some of them is undetermined";

/// The certificate of the derivatives along `directions` (num_variables x columns, named; `sizes`
/// as in DualityGap). Contacts at a kink that no direction moves are left out: by fixed steps,
/// where the derivatives along and against each direction and the tangent are the same after every
/// step (a run with three tangents). It covers the rollout and, where rows are redundant (a box on
/// a box), whether each direction is consistent with them (two rollouts). Where masses are very
/// different, rows redundant, a system ill-conditioned or events many, `linear_residual` is at
/// least the gap between tangent and adjoint (duality.h), both of which are run.
Certificate CertifyDerivative(const Model<double>& model, const State<double>& initial,
                              const RowMatrixXd& directions, const std::vector<std::string>& names,
                              const std::vector<double>& sizes = {},
                              const std::vector<StateRead>& reads = {});

/// "contact of ball and floor", "low limit of joint hinge".
std::string ContactName(const ModelStructure& structure, const ActiveContact& contact);
/// "open", "sticking", "sliding_right" (along the tangent), "sliding_left", "closed" (without
/// friction).
const char* ModeName(ContactMode mode);

}  // namespace tangible
