// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/trace.h"

#include <algorithm>
#include <tuple>

#include "tangible/dynamics/model/state_variable.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/verification/support/outputs.h"

namespace tangible {
namespace {

constexpr double kDegenerate = 1e-7;

VectorX<double> OutputsOf(const ModelStructure& structure, const State<double>& state) {
  VectorX<double> values(6 * structure.num_blocks());
  ForEachOutput(structure,
                [&](int output, int variable) { values[output] = StateNumber(state, variable); });
  return values;
}

// Two corners of a body that does not turn stop at the same time, and rounding decides which of
// them is found first: the key of an end of sliding is its bodies, and the modes tell which
// contacts stick afterwards.
auto KeyOf(const ContactTrace& trace) {
  const ActiveContact& c = trace.contact;
  const ContactFeature feature = trace.event == EventKind::kSlipEnds ? ContactFeature{} : c.feature;
  return std::tuple(trace.event, c.a, c.b, c.joint, c.side, feature.kind, feature.a, feature.b,
                    feature.part_a, feature.part_b);
}

bool SameChoice(const ContactTrace& x, const ContactTrace& y, FrictionAtZero friction) {
  if (KeyOf(x) != KeyOf(y) || x.contact.law != y.contact.law || x.friction_tie != y.friction_tie ||
      x.restitution_tie != y.restitution_tie || x.driven != y.driven) {
    return false;
  }
  // From friction 0 a contact goes on sliding; one that would stick has a kink there.
  const auto slides = [](ContactMode mode) {
    return mode == ContactMode::kClosed || SlidingSign(mode) != 0.0;
  };
  const bool one_closed = x.mode == ContactMode::kClosed || y.mode == ContactMode::kClosed;
  return x.mode == y.mode ||
         (friction == FrictionAtZero::kMaySlide && one_closed && slides(x.mode) && slides(y.mode));
}

// Closed contacts of a step, a segment or an impact, and the coefficients of each.
class PartTrace {
 public:
  PartTrace(long step, RunTrace* trace) : trace_(*trace), part_(trace->steps.emplace_back()) {
    trace->step_of.push_back(step);
  }

  void Add(const ActiveContact& contact, ContactMode mode, bool friction_tie, bool restitution_tie,
           bool driven = false) {
    if (mode == ContactMode::kOpen) {
      return;
    }
    // Only coefficients on which the equations depend count.
    friction_tie = friction_tie && mode != ContactMode::kSticking;
    const bool rebounds = contact.law == ContactLaw::kRestitution || driven;
    restitution_tie = restitution_tie && rebounds;
    part_.push_back({contact, mode, friction_tie, restitution_tie, driven});
    ++trace_.closed;
    trace_.sliding += SlidingSign(mode) != 0.0 ? 1 : 0;
    trace_.sticking += mode == ContactMode::kSticking ? 1 : 0;
    trace_.limits += contact.joint >= 0 ? 1 : 0;
    trace_.impacts += rebounds ? 1 : 0;
    trace_.recoveries += contact.law == ContactLaw::kRecovery ? 1 : 0;
    trace_.friction_tie = trace_.friction_tie || friction_tie;
    trace_.restitution_tie = trace_.restitution_tie || restitution_tie;
  }

  void AddEvent(EventKind event, const ActiveContact& contact) {
    ContactTrace& trace = part_.emplace_back();
    trace.contact = contact;
    trace.event = event;
  }

  // The order in which contacts of a pair are listed depends on which gap is smaller.
  void Finish() {
    std::sort(part_.begin(), part_.end(),
              [](const ContactTrace& x, const ContactTrace& y) { return KeyOf(x) < KeyOf(y); });
  }

 private:
  RunTrace& trace_;
  std::vector<ContactTrace>& part_;
};

void AddDegenerate(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
                   RunTrace* trace) {
  std::vector<int> degenerate;
  FindDegenerateContacts(problem, solution, kDegenerate, &degenerate);
  trace->degenerate += static_cast<int>(degenerate.size());
}

// A fixed step or an impact.
template <typename Record>
void TraceImpulses(const Record& record, long step, RunTrace* trace) {
  PartTrace part(step, trace);
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    part.Add(record.contacts[i], record.solution.modes[i], record.friction[i].tie,
             record.restitution[i].tie, record.problem.contacts[i].driven);
  }
  part.Finish();
  AddDegenerate(record.problem, record.solution, trace);
}

// The contact that stands for a touch. Where a face lands flat both its corners take part in the
// same impact, and rounding decides which of them is found first: the first in their order is used.
ActiveContact TouchOf(const Segment& segment, const EventPart* next) {
  const ActiveContact& touch = segment.event_contact;
  const auto has = [](const std::vector<ActiveContact>& contacts, const ActiveContact& contact) {
    return std::any_of(contacts.begin(), contacts.end(),
                       [&](const ActiveContact& c) { return c.SameAs(contact); });
  };
  if (segment.event != EventKind::kTouch || !touch.IsOfShapes() || next == nullptr ||
      !next->is_impulses || !has(next->impulses.contacts, touch)) {
    return touch;
  }
  const auto key = [](const ActiveContact& c) {
    return std::tuple(c.feature.part_a, c.feature.part_b, c.feature.kind, c.feature.a, c.feature.b);
  };
  const Impulses& impact = next->impulses;
  ActiveContact first = touch;
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    const ActiveContact& other = impact.contacts[i];
    if (other.IsOfShapes() && other.a == touch.a && other.b == touch.b &&
        impact.solution.modes[i] != ContactMode::kOpen && !has(segment.contacts, other) &&
        key(other) < key(first)) {
      first = other;
    }
  }
  return first;
}

void TraceSegment(const Segment& segment, const EventPart* next, long step, RunTrace* trace) {
  PartTrace part(step, trace);
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    part.Add(segment.contacts[i], segment.modes[i], segment.friction[i].tie, false);
  }
  if (segment.event != EventKind::kStepEnd) {
    // The edge of a force's window has no contact; the record still has that of an earlier segment.
    const bool of_contact = segment.event != EventKind::kEdge;
    part.AddEvent(segment.event, of_contact ? TouchOf(segment, next) : ActiveContact());
  }
  part.Finish();
  for (int k = 0; k < segment.num_stages; ++k) {
    AddDegenerate(segment.stages[k].problem, segment.stages[k].solution, trace);
  }
}

void TraceIsland(const IslandRecord& island, long step, RunTrace* trace) {
  const EventRecord& record = island.events;
  const size_t first = trace->steps.size();
  for (int k = 0; k < record.num_parts; ++k) {
    const EventPart& part = *record.parts[k];
    if (part.is_impulses) {
      TraceImpulses(part.impulses, step, trace);
    } else {
      TraceSegment(part.segment, k + 1 < record.num_parts ? record.parts[k + 1].get() : nullptr,
                   step, trace);
    }
  }
  for (size_t k = first; k < trace->steps.size(); ++k) {
    for (ContactTrace& contact : trace->steps[k]) {
      contact.contact = island.InWhole(contact.contact);
    }
  }
}

void TraceStep(Stepper* stepper, long step, RunTrace* trace) {
  if (!stepper->by_events()) {
    TraceImpulses(stepper->record(), step, trace);
    return;
  }
  const IslandRecords& records = stepper->parts();
  for (int k = 0; k < records.num_islands; ++k) {
    TraceIsland(*records.islands[k], step, trace);
  }
}

std::string Describe(const RunTrace& run, const ContactTrace& trace) {
  static const char* const kLaws[] = {"gap", "recovery", "restitution", "inelastic", "poisson"};
  if (trace.event == EventKind::kEdge) {
    return NameOf(trace.event);
  }
  if (trace.event != EventKind::kStepEnd) {
    return std::string(NameOf(trace.event)) + " of the " +
           ContactName(*run.structure, trace.contact);
  }
  std::string text = ContactName(*run.structure, trace.contact) + " " + ModeName(trace.mode);
  if (trace.contact.IsOfShapes()) {
    text += " (law " + std::string(kLaws[static_cast<int>(trace.contact.law)]) + ", feature " +
            std::to_string(static_cast<int>(trace.contact.feature.kind)) + ":" +
            std::to_string(trace.contact.feature.a) + ":" +
            std::to_string(trace.contact.feature.b) + ")";
  }
  text += trace.driven ? " driven" : "";
  if (trace.friction_tie || trace.restitution_tie) {
    text += " at a tie of the mixing rule";
  }
  return text;
}

// The first contact in which two steps differ.
std::string Difference(const RunTrace& x, const RunTrace& y, size_t step, FrictionAtZero friction) {
  const std::vector<ContactTrace>& a = x.steps[step];
  const std::vector<ContactTrace>& b = y.steps[step];
  const size_t both = std::min(a.size(), b.size());
  for (size_t i = 0; i <= both; ++i) {
    if (i < both && SameChoice(a[i], b[i], friction)) {
      continue;
    }
    if (i == a.size() && i == b.size()) {
      return "";
    }
    return "step " + std::to_string(x.step_of[step]) + ": " +
           (i < a.size() ? Describe(x, a[i]) : "nothing more") + " became " +
           (i < b.size() ? Describe(y, b[i]) : "nothing more");
  }
  return "";
}

}  // namespace

RunTrace TraceRun(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  RunTrace trace;
  trace.structure = model.structure;
  const StateObserver observe = [&](long k, double, const State<double>&, Stepper* stepper) {
    if (stepper != nullptr) {
      TraceStep(stepper, k - 1, &trace);
    }
  };
  const RolloutReport report = Rollout(model, state, observe, &state);
  trace.done = report.status == StepStatus::kDone;
  trace.message = report.message;
  trace.values = OutputsOf(*model.structure, state);
  return trace;
}

std::string FirstDifference(const RunTrace& x, const RunTrace& y, FrictionAtZero friction) {
  for (size_t step = 0; step < std::min(x.steps.size(), y.steps.size()); ++step) {
    std::string difference = Difference(x, y, step, friction);
    if (!difference.empty()) {
      return difference;
    }
    if (x.step_of[step] != y.step_of[step]) {
      return "step " + std::to_string(x.step_of[step]) + ": its events became other ones";
    }
  }
  return x.steps.size() == y.steps.size() ? "" : "the number of steps or events";
}

bool SameChoices(const RunTrace& x, const RunTrace& y, FrictionAtZero friction) {
  return FirstDifference(x, y, friction).empty();
}

}  // namespace tangible
