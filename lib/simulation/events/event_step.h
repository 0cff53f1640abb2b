// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Event stepping: a step of [t, t + h] as segments of smooth motion, ended by events that are
// located in time, and impacts between them.
//
//   1. contacts that touch: where one approaches, an impact (Newton's law, or Poisson's in two
//      phases; no forces) is solved, until none does
//   2. for those that neither approach nor separate an LCP in the accelerations determines which
//      stay closed, and whether they stick; where it has no solution (Painlevé) impulses of a very
//      short step are used instead
//   3. with these modes held the motion is integrated up to the earliest event (event_search.h)
//
// The time of an event is a function of state and parameters, by its own equation: gap = 0, sliding
// speed = 0, normal force = 0, friction at its limit. The derivatives (event_derivative.h) take
// this into account.

#include <string>
#include <vector>

#include "tangible/dynamics/assembly/contact_search.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/lcp/contact/contact_decompression.h"
#include "tangible/lcp/contact/contact_inner_impulses.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/simulation/events/coupled_bodies.h"
#include "tangible/simulation/events/event_counts.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/impact_groups.h"
#include "tangible/simulation/events/rebounds.h"
#include "tangible/simulation/events/step_report.h"
#include "tangible/simulation/events/support_modes.h"

namespace tangible {

/// Whether a step goes on however many events end its segments, or stops at the second one.
enum class AtEvent { kGoOn, kStopAtSecond };

/// A joint limit that is violated although recovery should move it.
struct BrokenLimit {
  ActiveContact limit;
  int steps = 0;  ///< during which it has stayed unchanged
};

/// The data of the last event step that the next one uses, besides the state.
struct EventGuess {
  std::vector<ActiveContact> contacts;
  std::vector<ContactMode> modes;
  std::vector<BrokenLimit> broken_limits;
  bool starts = true;  ///< the next step is a run's first
  int located = 0;     ///< events that ended segments of the last step
  /// All bodies were one island when the islands were last looked for (islands/island_step.h).
  bool connected = false;

  void Clear();
  size_t bytes() const;
};

/// Sets the twists of what supports hold as a whole to 0: motions and projections leave rounding.
void TakeHeldSpeeds(const ModelStructure& structure, const std::vector<SupportState>& supports,
                    std::vector<double>* twist);
/// Sets a guess of all contacts open, without impulses.
void SizeGuess(const ContactProblem<double>& problem, ContactSolution<double>* guess);
/// Adds a solve to the report of a step.
void CountSolve(const ContactSolverReport& solved, StepReport* outcome);
/// "contact of ball and floor", "limit of joint hinge"; index −1: "joints".
std::string NameOfContact(const ModelStructure& structure,
                          const std::vector<ActiveContact>& contacts, int index);

/// Names the part of an impulse problem that was not solved: a contact, a joint that contradicts
/// others, or momentum.
std::string WhatIsUnsolved(const ModelStructure& structure, const Impulses& impulses,
                           const ContactSolverReport& solved);

class EventStepper {
 public:
  explicit EventStepper(const Model<double>& model);
  /// Continues with another model, for which the memory is used again.
  void Retarget(const Model<double>& model);

  StepReport Step(const Model<double>& model, double t, double h, State<double>* state,
                  AtEvent at_event = AtEvent::kGoOn);
  /// The record of the last step.
  const EventRecord& record() const { return record_; }
  EventRecord& mutable_record() { return record_; }
  const EventGuess& guess() const { return guess_; }
  EventGuess& mutable_guess() { return guess_; }

 private:
  StepReport Advance(const Model<double>& model, double t, double h, AtEvent at_event,
                     State<double>* state);
  struct Touching {
    std::vector<ActiveContact> contacts;
    std::vector<CoefficientSource> friction, restitution;
    std::vector<double> approach, slip;  ///< n v and t v, m/s
  };
  /// A contact at rest that counts as sliding, with its direction; 0: as open.
  struct EndingSlip {
    ActiveContact contact;
    double sign = 0.0;
  };
  void FindTouching(const Model<double>& model, const State<double>& state);
  void AddTouching(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact);
  /// Whether touching contact i is rolling friction of a contact that `contacts`, a list of those
  /// before it, leaves out.
  bool LacksItsContact(size_t i, const std::vector<ActiveContact>& contacts) const {
    const ActiveContact& contact = touching_.contacts[i];
    return contact.is_rolling && (contacts.empty() || !contacts.back().RollsBy(contact));
  }
  /// At the start of a step: a joint limit among the touching contacts that has been violated for
  /// some steps without moving, although recovery would move it by `moved` in each; −1: none.
  int StuckLimit(const Model<double>& model, const State<double>& state, double moved);
  bool SolveImpacts(const Model<double>& model, double t, State<double>* state,
                    StepReport* outcome);
  /// Poisson's law: after the compression each contact that rebounds pushes with at least e times
  /// the impulse of its compression (event_decompression.cc).
  bool Decompress(const Model<double>& model, const Impulses& compression, State<double>* state,
                  StepReport* outcome);
  Impulses& BeginImpulses(double t, const State<double>& state);
  /// An impact of the group `group` of impacts_.
  Impulses* ListImpact(const Model<double>& model, double t, double slow, int group,
                       const State<double>& state, StepReport* outcome);
  /// A touching contact that approaches, of the group whose impact is the next one at this instant:
  /// the one that has begun, or else that of the event that ended the last segment, or else that of
  /// the first contact that approaches; −1: none approaches faster than `slow`, m/s.
  int NextToStrike(double slow);
  /// The fastest approach of a group's contacts, m/s.
  double ApproachOf(int group) const;
  bool CountImpact(const Model<double>& model, double slow, int group, StepReport* outcome);
  /// "…: more than 303 events in a step of contact of a and b, max_events_per_step is 100".
  static std::string EventsDoNotEnd(const Model<double>& model, const char* what,
                                    const ActiveContact& contact);
  bool TakeEvent(const Model<double>& model, double now, double h, const Segment& segment,
                 State<double>* state, StepReport* outcome);
  /// Contacts that stop sliding at the instant of the event that ends a segment, and whose bodies
  /// are not coupled to those of the event, get separate events.
  bool EndOtherSlips(const Model<double>& model, double t, const Segment& segment,
                     State<double>* state, StepReport* outcome);
  /// The same of contacts that are handed over to another feature at the instant of an event.
  bool AddHandOvers(const Model<double>& model, double t, const Segment& segment,
                    State<double>* state, StepReport* outcome);
  bool SolveImpact(const Model<double>& model, Impulses* impact, State<double>* state,
                   StepReport* outcome);
  bool SolveInstant(const Model<double>& model, double now, double h, bool begins, bool at_end,
                    State<double>* state, StepReport* outcome);
  bool SolveInstantOrBehind(const Model<double>& model, double now, double h, bool begins,
                            bool at_end, State<double>* state, StepReport* outcome);
  /// At a step's start and past edges, which `passed` lists: puts driven bodies on the side after
  /// them, and takes the bodies that joints hold to them along. Knots of further paths are due
  /// then.
  bool FollowAfter(const Model<double>& model, double now, const EdgeGroup& passed,
                   State<double>* state, StepReport* outcome);
  /// What is left of edges behind the first one: the knots of further paths, unless some of all
  /// these bodies drive the same ones, which meet all of their new twists at once.
  EdgeGroup LeftOf(const Model<double>& model, const EdgeGroup& passed, const State<double>& state);
  /// Twists that the joints allow, by an impulse as a new part of the record.
  bool ProjectOntoJoints(const Model<double>& model, double now, State<double>* state);
  /// At a run's start: where the initial twists turn a joint with friction alone by the joints'
  /// impulses, these come first.
  bool TurnJoints(const Model<double>& model, double now, State<double>* state,
                  StepReport* outcome);
  void BeginStep(const Model<double>& model, double t, double h, const State<double>& state);
  Segment& BeginSegment(double now, double until, const State<double>& state);
  /// What has been tried to go on in a step. Where contacts nearly jam accelerations change so fast
  /// with poses that only a short motion can be integrated: it is halved.
  struct Tries {
    int halvings = 0;        ///< of the next motion
    int halved_motions = 0;  ///< so far in the step
    bool short_step = false;
    bool held = false;     ///< what touches has been held
    std::string unsolved;  ///< why the short step has no solution either
    bool Halve();          ///< whether the motion may be halved once more
  };
  enum class Tried { kMoved, kAgain, kFailed };
  Tried TryMotion(const Model<double>& model, double now, double h, State<double>* state,
                  Tries* tries, StepReport* outcome, Segment* segment);
  void GuessModes(const std::vector<ActiveContact>& contacts, const std::vector<double>& slip,
                  double slow, ContactProblem<double>* problem,
                  ContactSolution<double>* solution) const;
  bool ChooseModes(const Model<double>& model, const State<double>& state, StepReport* outcome,
                   Segment* segment);
  bool ChooseContactModes(const Model<double>& model, double slow, std::vector<double> slip,
                          StepReport* outcome, Segment* segment);
  /// Takes the rest of its speed from what the supports of a motion hold, as a part of the record
  /// in the place of that motion.
  bool LimitJointFriction(Segment* segment) const;
  bool StopSupports(const Model<double>& model, const Segment& segment, int parts,
                    State<double>* state, StepReport* outcome);
  /// Ends a motion at the instant until which bodies at rest hold together what the support of one
  /// could not. False with a message where the motion until then cannot be integrated.
  bool EndWhereShareEnds(const Model<double>& model, Segment* segment, std::string* message);
  /// Whether what supports hold in a segment they hold as well with the loads after `length` of it.
  bool HoldsAfter(const Model<double>& model, const Segment& segment, double length);
  /// Shortens a motion to what the contacts of ellipses allow (ellipse_motion.h): to the next
  /// multiple of dt / 2^k. Near states have the same k, so that its end is a given instant and
  /// derivatives are exact.
  void ShortenAtEllipses(const Model<double>& model, const ContactSolution<double>& accelerations,
                         StepReport* outcome, Segment* segment);
  bool AddInstant(const Model<double>& model, double t, EventKind kind,
                  const ActiveContact* contact, State<double>* state, StepReport* outcome);
  /// A segment of zero length up to an edge, with the forces at `middle` and edges of windows that
  /// are still to come; null where there are no accelerations.
  Segment* AddEdge(const Model<double>& model, double t, double middle,
                   std::vector<WindowEdge> to_come, const State<double>& given,
                   StepReport* outcome);
  /// Those for edges of windows on the step's start, which it returns.
  EdgeGroup AddEdgesAtStart(const Model<double>& model, double t, const State<double>& state,
                            StepReport* outcome);
  /// Those for a group of edges at t.
  void AddEdgesHere(const Model<double>& model, double t, const EdgeGroup& edges,
                    const State<double>& state, StepReport* outcome);
  /// Goes past edges at the instant of the event that has ended the last motion.
  bool PassEdges(const Model<double>& model, double t, const EdgeGroup& edges, State<double>* state,
                 StepReport* outcome);
  /// Those between the first and the further edges of a group that has been reached.
  void AddFurtherEdges(const Model<double>& model, double t, const EdgeGroup& edges,
                       const State<double>& state, StepReport* outcome);
  /// A contact or support that lets go for the time between two edges of one instant, and holds
  /// behind them, takes up its hold at once: the speed that the time between gives is stopped again
  /// after a time of the same order, over a way of the second. The speed is 0, its derivative that
  /// of a projection onto what holds. The segments between edges are the parts from `first` on.
  void TurnOntoEdges(const Model<double>& model, double t, const State<double>& state,
                     StepReport* outcome);
  void HoldBehindEdges(const Model<double>& model, double t, double after, int first,
                       const State<double>& state, StepReport* outcome);
  /// Whether a pair has had so many events in this step that its slow impacts count as a rattle (an
  /// infinite sequence of ever smaller impacts).
  bool Rattles(const Model<double>& model, const ActiveContact& contact) const;
  /// Whether a pair has had so many events that it no longer rebounds.
  bool IsInelastic(const Model<double>& model, const ActiveContact& contact) const {
    return counts_.Of(contact) > model.structure->settings.max_events_per_step;
  }
  /// The speed below which gravity, the loads of the step or a support's friction bring a contact
  /// (a limit) back before it has left the touching tolerance, m/s (of an angle's rad/s).
  double ReturnSpeed(const Model<double>& model, const State<double>& state,
                     const ActiveContact& contact) const;
  /// Of an impact's contacts, the pairs of bodies, and the joints, with events in the step.
  int NumPairsWithEvents(const Impulses& impact) const;
  /// The size of the bodies of a contact, m; of an angle's limit 1 rad.
  double SizeOfGap(const Model<double>& model, const ActiveContact& contact) const;
  /// The speed below which a touching contact counts as neither approaching nor leaving nor
  /// sliding, m/s.
  double SlowSpeed(const Model<double>& model, const State<double>& state) const;
  /// The speed below which contacts of a problem without a solution are held, m/s.
  static double HeldSpeed(const Model<double>& model);
  /// The modes of contacts that are held where accelerations are not found: those that slide no
  /// faster than `slow` (m/s) stick.
  static void HoldModes(const ContactProblem<double>& problem, const std::vector<double>& slip,
                        double slow, std::vector<ContactMode>* modes);
  /// In the place of an impact without a solution, all of whose contacts approach more slowly than
  /// that: they are held, with friction. Whether it was done.
  bool HoldsSlow(const Model<double>& model, Impulses* impact, State<double>* state,
                 StepReport* outcome);
  /// The same of all contacts that touch and do not leave, where no motion from here can be
  /// integrated, as a new part of the record.
  bool HoldsTouching(const Model<double>& model, double t, State<double>* state,
                     StepReport* outcome);
  bool Settle(const Model<double>& model, const Impulses& impact, State<double>* state,
              StepReport* outcome);
  bool LocateTouch(const Model<double>& model, double t, double slow, int group,
                   State<double>* state, StepReport* outcome);
  bool SolveByShortStep(const Model<double>& model, double t, double dt, State<double>* state,
                        StepReport* outcome);
  ContactMode GuessOf(const ActiveContact& contact) const;
  void SwitchMode(const Segment& segment);
  /// Where the last segment's event ends it at its start (EventSearch::ends_at_start): takes it
  /// back and releases the event's contact, with its like (SwitchMode), in the next one. Takes a
  /// segment back too in which a released contact closes or slides the other way (contacts that
  /// jam): then none is released. A slip that ends at its start (kSlipEnds) does not begin. Whether
  /// it has taken the segment back.
  bool Releases(const Model<double>& model, const Segment& segment);
  /// What lets go together in the next motion (Segment::release).
  void ReleaseTogether(const Segment& segment);
  /// Opens contacts without a load to which held modes would give a share of what others bear: as
  /// loads change they would pull, or hold by friction that they do not have.
  void OpenIdle(const Model<double>& model, Segment* segment, ContactSolution<double>* solution);
  /// The slip with which contact i of touching_ counts, and whether it may be closed.
  double SlipAtStart(size_t i, double slow, bool* is_open) const;

  EventSearch search_;
  SegmentFlow flow_;
  ContactSolver solver_;
  InnerImpulses inner_impulses_;
  EventRecord record_;
  double inside_ = 0.0;  ///< the time that tells the pieces on which paths are followed
  EdgeGroup due_;        ///< at the instant of the last event or edge
  AssemblyScratch<double> assembly_;
  State<double> before_edge_;  ///< with the joints that end at the edge
  Touching touching_;
  std::vector<bool> rebounds_;  ///< of the last impact's contacts
  DecompressionSolver decompression_;
  SupportModes supports_;
  double turned_at_ = 0.0;  ///< the last instant of TurnOntoEdges in the step
  SolvedNode start_;        ///< accelerations at the start of a motion, with its supports
  SolvedNode idle_;         ///< the same with held modes, where contacts have no load
  std::vector<ActiveContact> listed_contacts_;  ///< of it, before their modes are chosen
  std::vector<CoefficientSource> listed_friction_;
  Segment trial_;  ///< of HoldsAfter, and what it leaves as it was
  SupportModes trial_supports_;
  EventGuess trial_guess_;
  int times_share_ended_ = 0;  ///< in this step
  EventGuess guess_;
  EventCounts counts_;              ///< of this step
  Rebounds last_rebounds_;          ///< of this step
  EventCounts shortened_;           ///< motions shortened at ellipses in this step
  ImpactGroups impacts_;            ///< of this instant
  CoupledBodies coupled_;           ///< as contacts stop sliding
  std::vector<EndingSlip> ending_;  ///< contacts that slide until a separate event
  /// Whether slow contacts hold in the next motion whatever the accelerations: where these have no
  /// solution, or always.
  enum class Holds { kNone, kUnsolved, kAll };
  Holds holds_ = Holds::kNone;
  /// Accelerations were not found once in this step: the last resorts of others follow only where
  /// nothing else helps.
  bool limited_ = false;
  /// Contacts at their limit as the next motion starts, beyond which they would go in it: the
  /// accelerations at the start do not tell that they slide or open.
  std::vector<EndingSlip> released_;
  /// Contacts at rest that would slide backwards in the next motion as soon as they slide.
  std::vector<ActiveContact> resting_;
  /// Of these, those that then held with more than their limit, and have been opened.
  std::vector<ActiveContact> jammed_;
};

}  // namespace tangible
