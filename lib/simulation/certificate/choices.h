// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The discrete choices of a run, and how far each is from its change.
//
//   fixed steps   the mode and the law of every contact of every step, the modes of servos
//   by events     the events of every contact, their order where bodies transmit impulses, the
//                 modes of impacts, and that no event happens where none does: forces and slips of
//                 closed contacts, gaps that turn around above 0
//
// The derivative of a run is that of its choices: beside a change it is another one. Choices of two
// runs are compared by their keys; each slack is a smooth function of the parameters as long as
// choices are the same.

#include <map>
#include <string>
#include <vector>

#include "tangible/lcp/contact/contact_inner_impulses.h"
#include "tangible/simulation/events/coupled_bodies.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

enum class ChoiceKind : unsigned char {
  kMode,           ///< of a contact of a step, or of an impact
  kClosing,        ///< an open contact closes
  kOpening,        ///< a closed contact opens
  kFrictionLimit,  ///< a contact that sticks begins to slide
  kSlidingSpeed,   ///< a contact that slides begins to stick
  kThreshold,      ///< the speed above which an impact rebounds
  kReach,          ///< whether a free motion reaches the surface within a step
  kRecovery,       ///< the speed at which bodies leave penetration
  kWindow,         ///< the step in which a force's window opens or closes, or a joint ends
  kEvent,          ///< an event before the end of the run
  kAfterEnd,       ///< an event just behind the end of the run
  kOrder,          ///< which of two events is first
  kGrazing,        ///< a touch that would not happen if it were less deep
  kMiss,           ///< a gap that turns around above 0
};

/// What tells a choice of a run from the others, and the same choice of another run.
struct ChoiceKey {
  ChoiceKind kind = ChoiceKind::kMode;
  long when = 0;   ///< the step, or how many choices of this kind the contact has had before
  int detail = 0;  ///< the mode and law, or the kind of the event
  int a = -1, b = -1, joint = -1, side = 0;
  int feature = 0, feature_a = 0, feature_b = 0, part_a = 0, part_b = 0;

  friend auto operator<=>(const ChoiceKey&, const ChoiceKey&) = default;
};

struct Choice {
  ChoiceKey key;
  ActiveContact contact;
  double time = 0.0;   ///< s
  double slack = 0.0;  ///< in a unit of its own; at 0 the choice changes
  double scale = 0.0;  ///< the size of the terms of which the slack is a difference
  /// Whether a run without this choice has other choices. Slacks alone come and go with them.
  bool decides = false;
};

/// "contact of ball and floor, opening".
std::string NameOf(const ModelStructure& structure, const Choice& choice);

/// The choices of a run in the order of their keys, of those with the same key the one with the
/// smallest slack.
using ChoiceList = std::vector<Choice>;

/// Of a run that makes more choices, some 250 MB, none are kept: a crowd over many steps.
inline constexpr size_t kMostChoices = 1000000;

/// The key of a choice that one of the runs makes and the other does not; null if there is none.
const Choice* FirstDifference(const ChoiceList& x, const ChoiceList& y);

/// Collects the choices of a run.
class ChoiceWatch {
 public:
  /// `end`: of the run, s. By events steps may follow, whose first events are choices of the run:
  /// they might happen before its end.
  explicit ChoiceWatch(double end) : end_(end) {}
  /// The step that the stepper has just done.
  void AddStep(const Model<double>& model, long step, Stepper* stepper);
  /// Whether there were more than kMostChoices; the list is then not complete.
  bool is_full() const { return is_full_; }
  /// After the last step.
  ChoiceList Finish(const Model<double>& model);

 private:
  struct Past {
    ChoiceKey key;
    ActiveContact contact;
    double time = 0.0;
    bool is_edge = false;
    std::vector<int> bodies{};  ///< of the island in which an edge acts; empty: of all
  };
  struct Phase {
    ContactMode mode = ContactMode::kOpen;
    long number = 0;
    double last_seen = 0.0;
    bool begins_to_slide = false;  ///< its slip is 0 at its start, whatever varies
    ChoiceList pending;            ///< in the order of time
  };
  /// What is left of a servo's limit on one side, at the end of the last motion.
  struct Reserve {
    Choice choice;
    bool falls = true;  ///< to it: from the start on, or from what was left before
  };
  void AddFixed(const Model<double>& model, long step, Stepper* stepper);
  /// The first step without a joint that ends, and how far the others are from being it.
  void AddReleases(const Model<double>& model, long step, const StepRecord& record);
  void AddServos(const Model<double>& model, long step, const StepRecord& record);
  /// By events: where what is left of a servo's limit turns around above 0.
  void AddReserves(const Model<double>& model, const IslandRecord& island, long step,
                   const Segment& segment);
  void AddLaw(const Model<double>& model, long step, const StepRecord& record, size_t i);
  /// A contact that the step before was too far from its surface to look at.
  void AddApproached(const Model<double>& model, long step, const StepRecord& record, size_t i);
  void AddImpact(const Model<double>& model, const IslandRecord& island, const Impulses& impact);
  void AddSegment(const Model<double>& model, const IslandRecord& island, long step,
                  Segment* segment);
  /// Where a pair of bodies, or a joint's limit, begins to be held together.
  void AddClosed(const Segment& segment, const ActiveContact& contact, double same);
  void AddForces(const Model<double>& model, const IslandRecord& island, long step,
                 const Segment& segment, size_t i, const ContactSolution<double>& share);
  void AddEvent(const Model<double>& model, const IslandRecord& island, const Segment& segment);
  void AddOrder(const Model<double>& model, const IslandRecord& island, const Segment& segment,
                const Past& now);
  void EndPhases(const IslandRecord& island, const Segment& segment);
  Phase* PhaseOf(const ActiveContact& contact);
  /// Takes over what the phase has held; `ended`: the kind of the slack that is 0 at its end.
  void Commit(Phase* phase, ChoiceKind ended = ChoiceKind::kMode);
  long Count(ChoiceKind kind, const ActiveContact& contact);
  void Push(const Choice& choice) { choices_.push_back(choice); }

  double end_;
  bool is_full_ = false;
  ChoiceList choices_;
  std::vector<Past> past_;
  std::map<ChoiceKey, Phase> phases_;
  std::map<ChoiceKey, long> counts_;
  std::vector<ActiveContact> last_contacts_;  ///< of the last fixed step
  std::map<ChoiceKey, double> closed_until_;  ///< s, of each pair
  std::map<ChoiceKey, Reserve> reserves_;     ///< by side
  InnerImpulses inner_impulses_;
};

}  // namespace tangible
