// SPDX-License-Identifier: Apache-2.0
//
// The stepper's event step: it runs island_step.h and reports the result like any other step.
#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

// The place of a contact in the record of the whole step; `first` is that of its island's first.
size_t PlaceOf(const ActiveContact& contact, const CoefficientSource& friction,
               const CoefficientSource& restitution, size_t first, StepRecord* record) {
  for (size_t i = first; i < record->contacts.size(); ++i) {
    if (record->contacts[i].SameAs(contact)) {
      return i;
    }
  }
  record->contacts.push_back(contact);
  record->friction.push_back(friction);
  record->restitution.push_back(restitution);
  record->solution.normal_impulse.push_back(0.0);
  record->solution.tangent_impulse.push_back(0.0);
  record->solution.modes.push_back(ContactMode::kOpen);
  return record->contacts.size() - 1;
}

// Number of bodies that the rows of some part push but that no rows turn.
int AnglesLeftOut(const IslandRecords& records, std::vector<Turning>* scratch) {
  int count = 0;
  for (int k = 0; k < records.num_islands; ++k) {
    const EventRecord& record = records.islands[k]->events;
    scratch->clear();
    for (int p = 0; p < record.num_parts; ++p) {
      const EventPart& part = *record.parts[p];
      if (part.is_impulses) {
        AddTurning(part.impulses.problem, scratch);
      } else if (part.segment.num_stages > 0) {
        AddTurning(part.segment.stages[0].problem, scratch);
      }
    }
    count += CountAnglesLeftOut(*scratch);
  }
  return count;
}

// A coefficient of an island's contact, by the numbers of the whole model.
CoefficientSource InWhole(const IslandRecord& island, CoefficientSource source) {
  for (int& number : source.numbers) {
    number = island.NumberInWhole(number);
  }
  return source;
}

// Adds the impulses of an island. Forces are integrated to impulses with the integrator's own
// weights.
void AddImpulses(const IslandRecord& island, const NystromTableau& tableau, StepRecord* record) {
  StepRecord& r = *record;
  const size_t first = r.contacts.size();
  // The rows of supports come after those of joints.
  const size_t joints =
      island.part ? island.part->joints.size() : r.solution.joint_impulse.size() / 3;
  const auto add_joints = [&](double weight, const std::vector<double>& impulses) {
    for (size_t k = 0; k < std::min(3 * joints, impulses.size()); ++k) {
      const size_t joint = island.JointInWhole(static_cast<int>(k / 3));
      r.solution.joint_impulse[3 * joint + k % 3] += weight * impulses[k];
    }
  };
  const auto place_of = [&](const ActiveContact& contact, const CoefficientSource& friction,
                            const CoefficientSource& restitution) {
    return PlaceOf(island.InWhole(contact), InWhole(island, friction), InWhole(island, restitution),
                   first, &r);
  };
  for (int p = 0; p < island.events.num_parts; ++p) {
    const EventPart& part = *island.events.parts[p];
    if (part.is_impulses) {
      const Impulses& impulses = part.impulses;
      for (size_t i = 0; i < impulses.contacts.size(); ++i) {
        const size_t at =
            place_of(impulses.contacts[i], impulses.friction[i], impulses.restitution[i]);
        r.solution.normal_impulse[at] += impulses.solution.normal_impulse[i];
        r.solution.tangent_impulse[at] += impulses.solution.tangent_impulse[i];
        r.solution.modes[at] = impulses.solution.modes[i];
      }
      add_joints(1.0, impulses.solution.joint_impulse);
      continue;
    }
    const Segment& segment = part.segment;
    for (size_t i = 0; i < segment.contacts.size(); ++i) {
      const size_t at = place_of(segment.contacts[i], segment.friction[i], CoefficientSource());
      for (int k = 0; k < segment.num_stages; ++k) {
        const double weight = segment.length * tableau.b[k];
        r.solution.normal_impulse[at] += weight * segment.stages[k].solution.normal_impulse[i];
        r.solution.tangent_impulse[at] += weight * segment.stages[k].solution.tangent_impulse[i];
      }
      r.solution.modes[at] = segment.modes[i];
    }
    for (int k = 0; k < segment.num_stages; ++k) {
      add_joints(segment.length * tableau.b[k], segment.stages[k].solution.joint_impulse);
    }
  }
}

}  // namespace

void Stepper::SumImpulses(const Model<double>& model) {
  StepRecord& r = record_;
  r.contacts.clear();
  r.friction.clear();
  r.restitution.clear();
  r.solution = ContactSolution<double>();
  r.solution.joint_impulse.assign(3 * model.structure->joints.size(), 0.0);
  const IslandRecords& records = events_->record();
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(model.structure->settings));
  for (int k = 0; k < records.num_islands; ++k) {
    AddImpulses(*records.islands[k], tableau, &r);
  }
}

StepReport Stepper::StepByEvents(const Model<double>& model, double t, double h,
                                 State<double>* state) {
  StepRecord& r = record_;
  r.time = t;
  r.h = h;
  r.before = *state;
  last_contacts_ = r.contacts;
  last_solution_.modes = r.solution.modes;
  StepReport report = events_->Step(model, t, h, state);
  SetReleased(model, ReleasedAtStep(*model.structure, t + h), state);
  const Rung rung = std::exchange(report.rung, Rung::kNone);
  report.gap_min = HUGE_VAL;
  const auto finite = [](const State<double>& x) {
    return AllFinite(x.pose) && AllFinite(x.twist);
  };
  if (report.status != StepStatus::kDone) {
    if (!finite(*state)) *state = r.before;
    return report;
  }
  SumImpulses(model);
  r.new_twist = state->twist;
  report.angles_left_out = AnglesLeftOut(events_->record(), &turning_);
  report.rung = r.contacts.empty() ? Rung::kDirect : std::max(rung, Rung::kModeChanges);
  report.contacts = static_cast<long>(r.contacts.size());
  size_t next = 0;
  for (size_t i = 0; i < r.contacts.size(); ++i) {
    report.gap_min = std::min(report.gap_min, r.contacts[i].gap);
    report.closed += r.solution.modes[i] != ContactMode::kOpen ? 1 : 0;
    report.lcp_rows += r.friction[i].value > 0.0 ? 3 : 1;
    report.single_rows += r.friction[i].value > 0.0 ? 0 : 1;
    // Most contacts follow each other as in the last step.
    ContactMode last = ContactMode::kOpen;
    for (size_t k = 0; k < last_contacts_.size(); ++k) {
      const size_t at = (next + k) % last_contacts_.size();
      if (last_contacts_[at].SameAs(r.contacts[i])) {
        last = last_solution_.modes[at];
        next = at + 1;
        break;
      }
    }
    report.mode_switches += last != r.solution.modes[i] ? 1 : 0;
  }
  if (!finite(*state)) {
    report.status = StepStatus::kDiverged;
    report.message = "a pose or twist is not finite";
  }
  return report;
}

}  // namespace tangible
