// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/trace.h"

#include <algorithm>
#include <tuple>

#include "tangible/simulation/certify.h"

namespace tangible {
namespace {

constexpr double kDegenerate = 1e-7;

// Calls visit(output, variable) in the order of the outputs.
template <typename Visit>
void ForEachOutput(const ModelStructure& structure, const Visit& visit) {
  int output = 0;
  for (const int body : structure.moving) {
    for (int i = 0; i < 6; ++i) {
      visit(output++,
            i < 3 ? structure.PoseVariable(body, i) : structure.TwistVariable(body, i - 3));
    }
  }
}

template <typename T>
const T& VariableOf(const State<T>& state, int variable) {
  const int poses = static_cast<int>(state.pose.size());
  return variable < poses ? state.pose[variable] : state.twist[variable - poses];
}

VectorX<double> OutputsOf(const ModelStructure& structure, const State<double>& state) {
  VectorX<double> values(6 * structure.num_blocks());
  ForEachOutput(structure,
                [&](int output, int variable) { values[output] = VariableOf(state, variable); });
  return values;
}

auto KeyOf(const ContactTrace& trace) {
  const ActiveContact& c = trace.contact;
  return std::tuple(c.a, c.b, c.joint, c.side, c.feature.kind, c.feature.a, c.feature.b);
}

bool SameChoice(const ContactTrace& x, const ContactTrace& y, FrictionAtZero friction) {
  if (KeyOf(x) != KeyOf(y) || x.contact.law != y.contact.law || x.friction_tie != y.friction_tie ||
      x.restitution_tie != y.restitution_tie) {
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

void TraceStep(const StepRecord& record, RunTrace* trace) {
  std::vector<ContactTrace>& step = trace->steps.emplace_back();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ContactMode mode = record.solution.modes[i];
    if (mode == ContactMode::kOpen) {
      continue;
    }
    const ContactLaw law = record.contacts[i].law;
    // Of what the step's equations depend on.
    const bool friction_tie = record.friction[i].tie && mode != ContactMode::kSticking;
    const bool restitution_tie = record.restitution[i].tie && law == ContactLaw::kRestitution;
    step.push_back({record.contacts[i], mode, friction_tie, restitution_tie});
    ++trace->closed;
    trace->sliding += SlidingSign(mode) != 0.0 ? 1 : 0;
    trace->sticking += mode == ContactMode::kSticking ? 1 : 0;
    trace->limits += record.contacts[i].joint >= 0 ? 1 : 0;
    trace->impacts += law == ContactLaw::kRestitution ? 1 : 0;
    trace->recoveries += law == ContactLaw::kRecovery ? 1 : 0;
    trace->friction_tie = trace->friction_tie || friction_tie;
    trace->restitution_tie = trace->restitution_tie || restitution_tie;
  }
  // The order in which contacts of a pair are listed depends on which gap is smaller.
  std::sort(step.begin(), step.end(),
            [](const ContactTrace& x, const ContactTrace& y) { return KeyOf(x) < KeyOf(y); });
  std::vector<int> degenerate;
  FindDegenerateContacts(record.problem, record.solution, kDegenerate, &degenerate);
  trace->degenerate += static_cast<int>(degenerate.size());
}

std::string Describe(const RunTrace& run, const ContactTrace& trace) {
  static const char* const kLaws[] = {"gap", "recovery", "restitution"};
  std::string text = ContactName(*run.structure, trace.contact) + " " + ModeName(trace.mode);
  if (trace.contact.joint < 0) {
    text += " (law " + std::string(kLaws[static_cast<int>(trace.contact.law)]) + ", feature " +
            std::to_string(static_cast<int>(trace.contact.feature.kind)) + ":" +
            std::to_string(trace.contact.feature.a) + ":" +
            std::to_string(trace.contact.feature.b) + ")";
  }
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
    return "step " + std::to_string(step) + ": " +
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
  const StateObserver observe = [&](long, double, const State<double>&, Stepper* stepper) {
    if (stepper != nullptr) {
      TraceStep(stepper->record(), &trace);
    }
  };
  const RolloutReport report = Rollout(model, state, observe, &state);
  trace.done = report.status == StepStatus::kDone;
  trace.message = report.message;
  trace.values = OutputsOf(*model.structure, state);
  return trace;
}

std::string FirstDifference(const RunTrace& x, const RunTrace& y, FrictionAtZero friction) {
  if (x.steps.size() != y.steps.size()) {
    return "the number of steps";
  }
  for (size_t step = 0; step < x.steps.size(); ++step) {
    std::string difference = Difference(x, y, step, friction);
    if (!difference.empty()) {
      return difference;
    }
  }
  return "";
}

bool SameChoices(const RunTrace& x, const RunTrace& y, FrictionAtZero friction) {
  return FirstDifference(x, y, friction).empty();
}

}  // namespace tangible
