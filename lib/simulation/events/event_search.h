// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where the next event is: the smallest τ in (0, length] at which a segment's motion closes a gap,
// ends a slip, reaches the limit of friction, lifts a contact off or takes a servo to its bound.
//
// Every candidate motion is the segment's own map at that length, so that the event's equation
// holds for the state that the segment ends with. Gaps: an interval on which gap(a) + gap(b)
// exceeds what the pair's speed bound can close is free of contact; others are halved, so that
// grazing and rotating corners are not missed (Mirtich, Impulse-based Dynamic Simulation, 1996, ch.
// 2, for the bound). Where bodies turn and move little between an interval's ends and the same
// features are closest at both, the gap's rates of change at the ends tell whether it has a root.
// Forces and sliding speeds are sampled at the segment's middle and end.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tangible/dynamics/elements/support.h"
#include "tangible/geometry/broad_phase.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

/// The speed within which a body's points are taken to stay over a motion, from their speeds at
/// both ends, m/s. With a constant acceleration it is the larger of them; a quarter of their
/// difference and 2 % are added for one that changes. Motions that are faster in between exist, so
/// that it is no bound: islands are checked by the distance travelled too (island_step.cc).
inline double LargestSpeedBetween(double before, double after) {
  return 1.02 * std::max(before, after) + 0.25 * std::abs(after - before);
}

/// The rate t·a of a contact's sliding speed, m/s², where moving bodies have given accelerations
/// and driven ones those of their paths at `time`, on the piece that `inside` tells; without what
/// turning directions add.
double SlipRate(const Model<double>& model, const State<double>& state, double time, double inside,
                const std::vector<double>& accelerations, const ActiveContact& contact);

class EventSearch {
 public:
  explicit EventSearch(const Model<double>& model);
  /// Continues with another model.
  void Retarget(const Model<double>& model);

  /// Starts the searches of the step [t, t + h], whose evaluations of the motion are bounded in
  /// number.
  void StartStep(const Model<double>& model, double t, double h, const State<double>& state);
  /// The bound is a multiple of max_events_per_step for each of this many pairs.
  void AllowEventsOf(int num_pairs) { num_pairs_with_events_ = std::max(1, num_pairs); }
  /// Shortens the segment to its first event, sets the kind of the event, and runs the segment up
  /// to it. `touching`: contacts within the touching tolerance at its start, which are no events
  /// while they stay within it.
  bool Run(const Model<double>& model, const std::vector<ActiveContact>& touching, Segment* segment,
           std::string* message);

  /// Whether the last search has found that the segment's event_contact does not keep its mode: its
  /// normal force is 0 at the start (kLiftOff), or its friction at the limit (kSlipBegins), and
  /// would go on beyond; or a contact that begins to slide would slide backwards (kSlipEnds).
  bool ends_at_start() const { return ends_at_start_; }
  /// Whether the next search keeps the modes of such contacts.
  void KeepStarts(bool keeps) { keeps_starts_ = keeps; }

  /// Whether the last search has found a support, or a contact beside one, beyond its limit whose
  /// share others could take, so that no event lets it go.
  bool lets_go_with_others() const { return lets_go_with_others_; }
  /// The state after a motion of this length of the segment of the last search; null where it
  /// cannot be integrated.
  const State<double>* StateAfter(const Model<double>& model, double length) {
    const Sample* const sample = At(model, length);
    return sample->good ? &sample->motion.after : nullptr;
  }

  /// A closed contact whose feature another one of its pair replaces.
  struct HandOver {
    ActiveContact lost, next;
  };
  /// Contacts of other pairs than the event's that are handed over at the instant of the event that
  /// the last search found.
  const std::vector<HandOver>& hand_overs() const { return hand_overs_; }

  /// The sizes of bodies and the tolerances on gaps that follow from them.
  const Lengths& lengths() const { return lengths_; }
  /// The gap below which a contact touches (m), or a joint is at its limit (m or rad).
  double TouchTolerance(const Model<double>& model, const State<double>& state,
                        const ActiveContact& contact) const {
    return contact.joint >= 0 ? lengths_.LimitTouch(state, model.structure->joints[contact.joint])
                              : lengths_.Touch(state, contact.a, contact.b);
  }
  /// Speed below which a touching contact neither approaches nor slides, m/s.
  double SpeedTolerance(const Model<double>& model, const State<double>& state) const;
  /// What loads other than gravity accelerate bodies to in a time step, m/s (load_speed.h).
  double load_speed() const { return load_speed_; }
  /// All contacts of a pair within `reach`; gap set.
  void FindContacts(const Model<double>& model, const State<double>& state, double reach,
                    std::vector<ActiveContact>* contacts);
  /// The fallbacks of all motions of the searches.
  const FlowCounts& flow_counts() const { return flow_.counts(); }
  /// Of the last search for contacts: boxes compared, pairs whose boxes overlap.
  int num_compared() const { return broad_phase_.num_compared(); }
  int num_pairs() const { return static_cast<int>(pairs_.size()); }

 private:
  struct Sample {
    double length = 0.0;
    Segment motion;
    bool good = false;
    bool has_end = false;  ///< the accelerations after the motion are solved
    SolvedNode end;
  };
  struct Event {
    double length = 0.0;
    EventKind kind = EventKind::kStepEnd;
    ActiveContact contact;
    int index = -1;
    double sign = 0.0;
    SupportState support{};            ///< of kSupportLetsGo
    std::vector<ReleaseRate> release;  ///< of contacts that let go together
    bool at_once = false;
    bool at_start = false;
    /// Where a contact is handed over (Segment::hands_over), which counts while that is the event.
    double hands_over_at = -1.0;
    bool passes = false;
    ActiveContact lost{};
  };
  class PairSearch;  ///< event_search_pair.cc
  Sample* At(const Model<double>& model, double length);
  /// The same; where a motion costs much, one of length 0 without its corrections, which rounding
  /// alone needs there.
  Sample* From(const Model<double>& model, double length);
  void TakeMotion(Sample* sample, Segment* segment);
  double SpeedAlongPath(const Model<double>& model, int body, double radius) const;
  void FindPairs(const Model<double>& model);
  /// ForEachPartNear over the segment.
  template <typename Visit>
  void ForEachNearPart(const Model<double>& model, int a, int b, const Visit& visit) const;
  void SortPairs(const Model<double>& model);
  void SearchPair(const Model<double>& model, int a, int b, PartPair parts, Event* event);
  // Searches for the time at which a contact that opens in penetration approaches again, if it has
  // not left by then.
  void SearchReturn(const Model<double>& model, const ActiveContact& contact, double touch,
                    Event* event);
  void SearchLimit(const Model<double>& model, int joint, double side, Event* event);
  void FindHandOvers(const Model<double>& model, Event* event);
  /// The first crossing of gap from above 0 within [from, to]; rate_over(a, b) bounds how fast it
  /// closes between; course_over(a, gap(a), b, gap(b)) tells what else is known about it. The
  /// crossing is found to |gap| ≤ tolerance, or as near as doubles allow.
  template <typename Gap, typename Rate, typename CourseOver>
  bool FirstRoot(const Model<double>& model, const Gap& gap, const Rate& rate_over,
                 const CourseOver& course_over, double tolerance, double from, double to,
                 double* root);
  void SearchClosed(const Model<double>& model, Event* event);
  /// Where a motion costs much: whether the function of a closed contact, positive at the start of
  /// a motion of this length, stays so until its half, by stages and rates at both ends.
  bool IsClearOfHalf(const Model<double>& model, const Event& trial, double at_start,
                     double length);
  /// The closed contact whose mode ends first, by values at both ends of the motion: once its event
  /// is found, the others are dismissed by its instant alone. Else the first one.
  size_t FirstToEnd(const Model<double>& model, const Event& event);
  /// Where loads change and rows share forces that are not determined: when accelerations without
  /// held modes begin to differ from those with them (event_release.cc).
  void SearchRelease(const Model<double>& model, Event* event);
  /// Whether they differ after a motion of this length, and the rates at which contacts then go.
  bool Departs(const Model<double>& model, double length, std::vector<ReleaseRate>* rates);
  bool IsShared(const Model<double>& model, const Event& trial);
  void TakeClosed(const Model<double>& model, const Event& trial, Event* event);
  static void SetEvent(const Event& event, Segment* segment);
  /// Whether loads change in a motion and rows share forces that are not determined.
  bool SharesChange(const Model<double>& model, double length);
  bool AreUnneeded(const Model<double>& model, double length, std::vector<ReleaseRate>* rates);
  bool SolveFree(const Model<double>& model, ContactProblem<double>* problem,
                 ContactSolution<double>* free);
  void TakeRelease(const std::vector<ReleaseRate>& rates, double length, Event* event);
  /// The accelerations after a motion; null where there are none.
  SolvedNode* EndOf(const Model<double>& model, Sample* sample);
  double WorkLeft(const Model<double>& model, double length, const std::vector<ReleaseRate>& rates);
  void SearchServos(const Model<double>& model, Event* event);  ///< servo_bounds.cc
  void SearchServo(const Model<double>& model, int servo, double sign, Event* event);
  void SearchSupports(const Model<double>& model, Event* event);  ///< support_bounds.cc
  void SearchStop(const Model<double>& model, int support, Event* event);
  void SearchFlushCorners(const Model<double>& model, Event* event);
  void SearchLetsGo(const Model<double>& model, int support, Event* event);
  bool TakeDeterminedShare(const Model<double>& model, int support, SolvedNode* node,
                           SupportState* next) const;
  const double* HeldAt(const Model<double>& model, int support, Sample* sample);
  SupportState LetsGoAt(const Model<double>& model, const State<double>& state, int support,
                        const double* held);
  /// SlipRate of an event's contact in its direction of sliding.
  double RateOfSlip(const Model<double>& model, const State<double>& state, double time,
                    const std::vector<double>& accelerations, const Event& event) const;
  double FindDip(const Model<double>& model, const Event& event, double a, double fa, double b,
                 double fb);
  bool IsDetermined(const Event& event, SolvedNode* node) const;
  void TryStart(const Model<double>& model, double tolerance, Event trial, Event* event);
  template <typename Function>
  double Refine(const Model<double>& model, const Function& f, double tolerance, double a,
                double fa, double b, double fb);
  double ModeValue(const Model<double>& model, Sample* sample, const Event& event);
  /// The tolerance to which a pair's gaps are located, m.
  double GapTolerance(const State<double>& state, int a, int b) const {
    return std::max(kLocatedOfSize * lengths_.Size(a, b),
                    kLocatedOfCoordinate * lengths_.Coordinate(state, a, b));
  }
  bool MovesLittle(const Model<double>& model, const State<double>& before,
                   const State<double>& after, double length, int a, int b) const;
  double TouchStart(double speed, double acceleration) const;

  Lengths lengths_;
  SegmentFlow flow_;
  Segment* segment_ = nullptr;
  const std::vector<ActiveContact>* touching_ = nullptr;
  double load_speed_ = 0.0;      ///< by loads in a time step (load_speed.h), m/s
  double slow_ = 0.0;            ///< the speed tolerance as the segment starts, m/s
  std::vector<double> closing_;  ///< bound on the speed of each body's points over the segment
  std::vector<HandOver> hand_overs_;
  std::vector<Sample> samples_;
  int num_samples_ = 0;
  Sample start_;  ///< of length 0 (From)
  bool has_start_ = false;
  long evaluations_ = 0;  ///< of the motion, in this step
  int num_pairs_with_events_ = 1;
  bool ends_at_start_ = false;
  bool keeps_starts_ = false;
  bool has_held_ = false;  ///< supports hold something in the segment
  bool lets_go_with_others_ = false;
  bool shares_ = false;   ///< SharesChange of the segment
  bool all_good_ = true;  ///< all samples of this search could be integrated
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::pair<double, std::pair<int, int>>> order_;  ///< pairs and when they close
  std::vector<Aabb> boxes_;
  std::vector<double> reach_;  ///< by which the boxes over the segment are grown, m
  BroadPhase broad_phase_;
  SupportFriction support_;
  ContactSolver solver_;  ///< of accelerations without held modes
  std::string message_;
};

}  // namespace tangible
