// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/step_forces.h"

#include <limits>

#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The motion at an end of a step: the last, or first, that takes some time.
const Segment* MotionAt(const EventRecord& events, ForceInstant instant, double h) {
  const Segment* found = nullptr;
  for (int p = 0; p < events.num_parts; ++p) {
    const EventPart& part = *events.parts[p];
    if (part.is_impulses || !(part.segment.length > kNoMotion * h)) continue;
    found = &part.segment;
    if (instant == ForceInstant::kStart) break;
  }
  return found;
}

// A force of an island's part; false where it does not act within the part.
bool ToPart(const IslandRecord& island, ConstraintForce* force) {
  if (island.part == nullptr) return true;
  if (force->joint >= 0) {
    force->joint = island.part->LocalJoint(force->joint);
    return force->joint >= 0;
  }
  force->a = island.part->LocalBody(force->a);
  force->b = island.part->LocalBody(force->b);
  return force->a >= 0 && force->b >= 0;
}

// The variable of the whole model that a part's is.
int InWhole(const ModelStructure& whole, const IslandRecord& island, int variable) {
  if (island.part == nullptr) return variable;
  const ModelStructure& own = *island.part->structure;
  const int poses = 3 * own.num_bodies();
  if (variable >= 2 * poses) {
    return whole.ParameterVariable(island.part->numbers[variable - 2 * poses]);
  }
  const int body = island.part->bodies[variable % poses / 3];
  return variable < poses ? whole.PoseVariable(body, variable % 3)
                          : whole.TwistVariable(body, variable % 3);
}

}  // namespace

// Values, the seeds ∂f/∂x (a row an unknown, a column a force), and w_bar += ∂f/∂w at fixed x.
void StepForces::SeedForces(const Model<double>& model, const SolvedEquations& solved,
                            const std::vector<ConstraintForce>& forces, int blocks,
                            RowMatrixXd* seeds, RowMatrixXd* w_bar, std::vector<double>* values) {
  seeds->setZero(3 * static_cast<Eigen::Index>(blocks), static_cast<Eigen::Index>(forces.size()));
  std::vector<double> seed;
  std::vector<JacobianEntry> direct;
  for (size_t f = 0; f < forces.size(); ++f) {
    const auto column = static_cast<Eigen::Index>(f);
    seed.assign(static_cast<size_t>(seeds->rows()), 0.0);
    direct.clear();
    values->push_back(EvaluateForce(model, solved, forces[f], &scratch_, seed.data(), &direct));
    seeds->col(column) = Eigen::Map<const Eigen::VectorXd>(seed.data(), seeds->rows());
    for (const JacobianEntry& entry : direct) (*w_bar)(entry.variable, column) += entry.value;
  }
}

void StepForces::OfFixedStep(const Model<double>& model, const std::vector<ConstraintForce>& forces,
                             Stepper* stepper, std::vector<StepForce>* out) {
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  ContactSystem& system = stepper->system();
  const ModelStructure& s = *model.structure;
  RowMatrixXd w_bar =
      RowMatrixXd::Zero(s.num_variables(), static_cast<Eigen::Index>(forces.size()));
  RowMatrixXd seeds;
  std::vector<double> impulses;
  solve_.GatherRates(s, system, &w_bar);
  SeedForces(model, record.View(system.contact_block()), forces, system.num_blocks(), &seeds,
             &w_bar, &impulses);
  solve_.rates() = seeds;
  solve_.Apply(model, record, &system, &w_bar);
  FollowStepAdjoint(model, record.time, record.h, &w_bar);
  for (size_t f = 0; f < forces.size(); ++f) {
    StepForce& force = (*out)[f];
    force.value = impulses[f] / record.h;
    for (int v = 0; v < s.num_variables(); ++v) {
      const double value = w_bar(v, static_cast<Eigen::Index>(f)) / record.h;
      if (value != 0.0) force.by_variables.push_back({0, v, value});
    }
  }
}

void StepForces::OfIsland(const Model<double>& whole, const std::vector<ConstraintForce>& forces,
                          ForceInstant instant, double h, const IslandRecord& island,
                          std::vector<StepForce>* out) {
  std::vector<ConstraintForce> own_forces;
  std::vector<size_t> places;
  for (size_t f = 0; f < forces.size(); ++f) {
    ConstraintForce force = forces[f];
    if (!ToPart(island, &force)) continue;
    own_forces.push_back(force);
    places.push_back(f);
  }
  const Segment* segment = MotionAt(island.events, instant, h);
  if (own_forces.empty() || segment == nullptr) return;
  Model<double> memory;
  const Model<double>& model = island.ModelOf(whole, &memory);
  const ModelStructure& s = *model.structure;
  const bool at_end = instant == ForceInstant::kEnd;
  SegmentFlow flow(model);
  SolvedNode node;
  if (!flow.Accelerate(model, *segment, at_end ? segment->after : segment->before,
                       segment->time + (at_end ? segment->length : 0.0), &node)) {
    return;
  }
  const auto columns = static_cast<Eigen::Index>(own_forces.size());
  RowMatrixXd w_bar = RowMatrixXd::Zero(s.num_variables() + 1, columns);
  RowMatrixXd seeds;
  std::vector<double> values;
  const SolvedEquations solved = ViewOf(*segment, node, false);
  SeedForces(model, solved, own_forces, node.system.num_blocks(), &seeds, &w_bar, &values);
  node.system.SolveTransposed(node.problem, node.solution.modes, seeds.data(),
                              static_cast<int>(columns));
  VisitJacobian(model, solved, JacobianRoute::kByHand, &scratch_,
                AdjointSink{seeds.data(), w_bar.data(), static_cast<int>(columns)});
  for (Eigen::Index f = 0; f < columns; ++f) {
    StepForce& force = (*out)[places[static_cast<size_t>(f)]];
    force.value = values[static_cast<size_t>(f)];
    for (int v = 0; v < s.num_variables(); ++v) {
      if (w_bar(v, f) == 0.0) continue;
      force.by_variables.push_back({0, InWhole(*whole.structure, island, v), w_bar(v, f)});
    }
  }
}

void StepForces::Evaluate(const Model<double>& model, const std::vector<ConstraintForce>& forces,
                          ForceInstant instant, Stepper* stepper, std::vector<StepForce>* out) {
  out->assign(forces.size(), StepForce());
  if (!stepper->by_events()) {
    OfFixedStep(model, forces, stepper, out);
    return;
  }
  const IslandRecords& records = stepper->parts();
  // Bodies that no island has together do not touch; what an island leaves open is not known.
  for (StepForce& force : *out) force.value = std::numeric_limits<double>::quiet_NaN();
  for (size_t f = 0; f < forces.size(); ++f) {
    bool any = false;
    for (int i = 0; i < records.num_islands; ++i) {
      ConstraintForce force = forces[f];
      any = any || ToPart(*records.islands[i], &force);
    }
    if (!any) (*out)[f].value = 0.0;
  }
  for (int i = 0; i < records.num_islands; ++i) {
    OfIsland(model, forces, instant, records.h, *records.islands[i], out);
  }
}

}  // namespace tangible
