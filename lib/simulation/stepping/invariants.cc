// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/invariants.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/elements/force.h"
#include "tangible/dynamics/elements/part_pairs.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/geometry/broad_phase.h"
#include "tangible/geometry/collide.h"
#include "tangible/math/disjoint_sets.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// A box that meets the boxes of all bodies to which the body in it has a negative gap. The gap
// between a face and a corner slightly beyond its end counts too, and is negative shortly before
// the boxes meet.
Aabb BoxOfTouching(const Aabb& box) {
  double grow = 0.0;
  for (const double length : {box.max_x - box.min_x, box.max_y - box.min_y}) {
    if (std::isfinite(length)) grow = std::max(grow, kCoupledBeyond * length);
  }
  double place = 0.0;
  for (const double x : {box.min_x, box.min_y, box.max_x, box.max_y}) {
    if (std::isfinite(x)) place = std::max(place, std::abs(x));
  }
  grow += kCoupledRounding * place;
  return {box.min_x - grow, box.min_y - grow, box.max_x + grow, box.max_y + grow};
}

}  // namespace

double KineticEnergy(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  double energy = 0.0;
  for (const int body : s.moving) {
    const double* v = &state.twist[3 * body];
    energy += 0.5 * model.parameters[s.bodies[body].mass] * (v[0] * v[0] + v[1] * v[1]) +
              0.5 * model.parameters[s.bodies[body].inertia] * v[2] * v[2];
  }
  return energy;
}

double PotentialEnergy(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  double energy = 0.0;
  for (const int body : s.moving) {
    energy -= model.parameters[s.bodies[body].mass] *
              (model.parameters[kGravityX] * state.pose[3 * body] +
               model.parameters[kGravityY] * state.pose[3 * body + 1]);
  }
  for (const SpringIndex& spring : s.springs) {
    SpringRow<double> row;
    EvaluateSpring(state.PoseOf(spring.a), state.PoseOf(spring.b),
                   &model.parameters[spring.numbers], &row);
    energy += 0.5 * row.tension *
              (row.length - model.parameters[spring.numbers + SpringIndex::kRestLength]);
  }
  for (const JointIndex& joint : s.joints) {
    if (joint.stiffness >= 0 && !IsReleased(s, state, joint)) {
      JointRows<double> rows;
      EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                    &model.parameters[joint.geometry], &rows);
      const double stretch = rows.coordinate - model.parameters[joint.stiffness + 1];
      energy += 0.5 * model.parameters[joint.stiffness] * stretch * stretch;
    }
  }
  return energy;
}

Vector3<double> Momentum(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  Vector3<double> sum = Vector3<double>::Zero();
  for (const int body : s.moving) {
    const double* x = &state.pose[3 * body];
    const double* v = &state.twist[3 * body];
    const double mass = model.parameters[s.bodies[body].mass];
    sum += Vector3<double>(
        mass * v[0], mass * v[1],
        mass * (x[0] * v[1] - x[1] * v[0]) + model.parameters[s.bodies[body].inertia] * v[2]);
  }
  return sum;
}

double DeepestPenetration(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  std::vector<Aabb> boxes;
  boxes.reserve(s.num_bodies());
  for (int body = 0; body < s.num_bodies(); ++body) {
    boxes.push_back(BoxOfTouching(BoxOf(model, body, state.PoseOf(body), 0.0)));
  }
  BroadPhase broad_phase;
  std::vector<std::pair<int, int>> pairs;
  broad_phase.FindPairs(
      boxes, [&s](int a, int b) { return s.MayCollide(a, b); }, &pairs);
  double deepest = 0.0;
  for (const auto& [first, second] : pairs) {
    const int a = first;
    const int b = second;
    const auto visit = [&](PartPair parts) {
      ContactFeature features[2];
      const ShapeView<double> shape_a = model.Shape(a, parts.a);
      const ShapeView<double> shape_b = model.Shape(b, parts.b);
      const Pose<double> pose_a = state.PoseOf(a);
      const Pose<double> pose_b = state.PoseOf(b);
      const int count = FindFeatures(model, a, pose_a, b, pose_b, parts,
                                     std::numeric_limits<double>::infinity(), features);
      for (int k = 0; k < count; ++k) {
        const double gap = EvaluateContact(features[k], shape_a, pose_a, shape_b, pose_b).gap;
        deepest = std::max(deepest, -gap);
      }
    };
    ForEachPartNear(model, a, state.PoseOf(a), boxes[a], b, state.PoseOf(b), boxes[b], 0.0, visit);
  }
  return deepest;
}

void AddClosedContacts(const StepRecord& record, std::vector<std::pair<int, int>>* pairs) {
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    if (record.solution.modes[i] != ContactMode::kOpen) {
      pairs->emplace_back(record.contacts[i].a, record.contacts[i].b);
    }
  }
}

int CountIslands(const ModelStructure& structure, const std::pair<int, int>* closed,
                 size_t num_closed) {
  DisjointSets blocks;
  blocks.AddAll(structure.num_blocks());
  int islands = structure.num_blocks();
  const auto join = [&](int a, int b) {
    if (a >= 0 && b >= 0 && blocks.Join(a, b)) --islands;
  };
  for (const SpringIndex& spring : structure.springs) {
    join(structure.bodies[spring.a].block, structure.bodies[spring.b].block);
  }
  for (const JointIndex& joint : structure.joints) {
    join(structure.bodies[joint.a].block, structure.bodies[joint.b].block);
    if (joint.c < 0) continue;
    join(structure.bodies[joint.a].block, structure.bodies[joint.c].block);
    join(structure.bodies[joint.a].block, structure.bodies[joint.d].block);
  }
  for (size_t i = 0; i < num_closed; ++i) {
    join(structure.bodies[closed[i].first].block, structure.bodies[closed[i].second].block);
  }
  return islands;
}

}  // namespace tangible
