// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/run_summary.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/dynamics/model/model_releases.h"
#include "tangible/lcp/system/contact_conditioning.h"
#include "tangible/simulation/stepping/invariants.h"

namespace tangible {
namespace {

OrderedJson MomentumJson(const Model<double>& model, const State<double>& state) {
  const Vector3<double> momentum = Momentum(model, state);
  return {momentum[0], momentum[1], momentum[2]};
}

double Energy(const Model<double>& model, const State<double>& state) {
  return KineticEnergy(model, state) + PotentialEnergy(model, state);
}

// Counts of what the model left out, in all steps.
OrderedJson ReductionsJson(const RolloutReport& report) {
  return {{"pairs_compared", report.pairs_compared},
          {"pairs_near", report.pairs_near},
          {"beyond_reach", report.beyond_reach},
          {"contacts", report.contacts},
          {"lcp_rows", report.lcp_rows},
          {"single_rows", report.single_rows},
          {"angles_left_out", report.angles_left_out},
          {"steps_without_lcp", report.SolvedBy(Rung::kDirect, Rung::kDirect)}};
}

OrderedJson FallbacksJson(const RolloutReport& report) {
  const ContactFallbacks& solver = report.solver;
  return {{"pivoting", solver.pivoting},
          {"interior_point", solver.interior_point},
          {"lemke", solver.lemke},
          {"dense", solver.dense},
          {"restarts", solver.restarts},
          {"extrapolation", solver.extrapolation},
          {"regularised", solver.regularised},
          {"whole_system", solver.whole_system},
          {"islands_together", solver.islands_together},
          {"newton_stages", report.newton_stages},
          {"halved_motions", report.halved_motions},
          {"damped_projections", report.damped_projections},
          {"short_steps", report.given_up.short_steps},
          {"rebounds_given_up", report.given_up.rebounds_given_up},
          {"held_contacts", report.given_up.held_contacts}};
}

long SumOf(const OrderedJson& counts) {
  long sum = 0;
  for (const auto& count : counts) {
    sum += count.get<long>();
  }
  return sum;
}

// Limit of the operations of the ranks that tell what is undetermined, for all groups of bodies
// together: a few seconds.
constexpr double kMostRankOperations = 1e10;

std::string NotCounted(const UndeterminedCounts& counts) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "not counted: a rank takes %.1e operations, more than %.0e; the largest group of "
                "bodies that joints and contacts connect has %d bodies and %d rows",
                counts.operations, kMostRankOperations, counts.largest.bodies, counts.largest.rows);
  return text.data();
}

// What the last step's equations leave undetermined (redundant supports, joints and sticking
// contacts), and which of the solutions the impulses are.
OrderedJson UndeterminedJson(const Model<double>& model, const State<double>& at,
                             const StepRecord& step) {
  ContactProblem<double> problem;
  AssemblyScratch<double> scratch;
  AssembleWithoutContacts(model, at, step.time, step.h, &problem, &scratch);
  AssembleContacts(model, at, step.h, step.contacts, step.friction, step.restitution, &scratch,
                   &problem);
  const UndeterminedCounts counts =
      CountUndetermined(problem, step.solution.modes, kMostRankOperations);
  if (!counts.counted) {
    return {{"impulses", nullptr},
            {"motions", nullptr},
            {"chosen", ""},
            {"reason", NotCounted(counts)}};
  }
  std::string chosen;
  if (counts.impulses > 0) {
    chosen =
        "of many impulses with the same motion those nearest to the step before's, from 0 "
        "where a contact begins, that signs and friction allow";
  }
  if (counts.motions > 0) {
    chosen =
        "contacts slide with different friction, so that the motion depends on how they share "
        "the load: as nearest to the step before, from 0 where a contact begins";
  }
  return {{"impulses", counts.impulses},
          {"motions", counts.motions},
          {"chosen", chosen},
          {"reason", ""}};
}

bool RunsByEvents(const Model<double>& model) {
  return model.structure->settings.stepping == Stepping::kEvent;
}

}  // namespace

void RunSummary::Keep(const Model<double>& model, const State<double>& state,
                      const Stepper* stepper) {
  if (!started_) {
    started_ = true;
    first_ = state;
  }
  if (!model.structure->joints.empty() || RunsByEvents(model)) {
    poses_.insert(poses_.end(), state.pose.begin(), state.pose.end());
    times_.push_back(stepper == nullptr ? 0.0 : stepper->record().time + stepper->record().h);
  }
  if (stepper != nullptr) {
    const StepRecord& record = stepper->record();
    AddClosedContacts(record, &closed_);
    closed_ends_.push_back(closed_.size());
    stepped_ = true;
    last_step_.time = record.time;
    last_step_.h = record.h;
    last_step_.before = record.before;
    last_step_.contacts = record.contacts;
    last_step_.friction = record.friction;
    last_step_.restitution = record.restitution;
    last_step_.solution.modes = record.solution.modes;
  }
}

bool RunSummary::IsFull() const {
  // As many numbers as remain in a processor's cache. A step of a scene that alone fills it takes
  // far longer than reading the clock.
  constexpr size_t kMostNumbers = 8192;
  constexpr size_t kMostSteps = 256;
  return poses_.size() + closed_.size() >= kMostNumbers || closed_ends_.size() >= kMostSteps;
}

void RunSummary::EvaluateKept(const Model<double>& model) {
  const ModelStructure& structure = *model.structure;
  const auto size = static_cast<std::ptrdiff_t>(first_.pose.size());
  auto time = times_.cbegin();
  for (auto pose = poses_.cbegin(); pose != poses_.cend(); pose += size, ++time) {
    at_.pose.assign(pose, pose + size);
    // What a joint let go has no drift.
    SetReleased(model, *time, &at_);
    joint_drift_max_ = std::max(joint_drift_max_, JointDrift(model, at_));
    if (RunsByEvents(model)) {
      penetration_max_ = std::max(penetration_max_, DeepestPenetration(model, at_));
    }
  }
  size_t begin = 0;
  for (const size_t end : closed_ends_) {
    const int islands = CountIslands(structure, closed_.data() + begin, end - begin);
    islands_max_ = std::max(islands_max_, islands);
    begin = end;
  }
  poses_.clear();
  times_.clear();
  closed_.clear();
  closed_ends_.clear();
}

OrderedJson RunSummary::ToJson(const Model<double>& model, const RolloutReport& report,
                               const State<double>& last) {
  EvaluateKept(model);
  const OrderedJson fallbacks = FallbacksJson(report);
  // The reports of fixed steps give the gaps at their starts, so that the end of the run is
  // evaluated here. Those of event stepping have only the pairs that act on each other.
  const double penetration =
      std::max({report.penetration_max, penetration_max_, DeepestPenetration(model, last)});
  OrderedJson undetermined = nullptr;
  if (stepped_) {
    // The rows of a fixed step are those at its start; the last ones of event stepping are those at
    // its end.
    undetermined =
        UndeterminedJson(model, RunsByEvents(model) ? last : last_step_.before, last_step_);
  }
  return {
      {"status", NameOf(report.status)},
      {"message", report.message},
      {"steps", report.steps},
      {"seconds", nullptr},
      {"cpu_seconds", nullptr},
      {"bodies", model.structure->world()},
      {"contacts_max", report.contacts_max},
      {"lcp_rows_max", report.lcp_rows_max},
      {"islands_max", islands_max_},
      {"events", report.events},
      {"bounces_ended", report.bounces_ended},
      {"ellipse_motions", report.ellipse_motions},
      {"fallbacks", SumOf(fallbacks)},
      {"solver",
       {{"guess", report.SolvedBy(Rung::kModeChanges, Rung::kPivotingFromGuess)},
        {"interior_point", report.SolvedBy(Rung::kInteriorPoint, Rung::kPivotingFromInteriorPoint)},
        {"lemke", report.SolvedBy(Rung::kPivotingFromOpen, Rung::kLemke)}}},
      {"fallback_kinds", fallbacks},
      {"reductions", ReductionsJson(report)},
      {"undetermined_end", undetermined},
      {"residual_max", report.residual},
      {"penetration_max", penetration},
      {"joint_drift_max", joint_drift_max_},
      {"impact_energy_gain_max", report.impact_energy_gain},
      {"energy_start", Energy(model, first_)},
      {"energy_end", Energy(model, last)},
      {"momentum_start", MomentumJson(model, first_)},
      {"momentum_end", MomentumJson(model, last)}};
}

}  // namespace tangible
