// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/invariants.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "tangible/dynamics/force.h"
#include "tangible/geometry/collide.h"

namespace tangible {

double KineticEnergy(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  double energy = 0.0;
  for (const int body : s.moving) {
    const double* v = &state.twist[3 * body];
    energy += 0.5 * model.numbers[s.bodies[body].mass] * (v[0] * v[0] + v[1] * v[1]) +
              0.5 * model.numbers[s.bodies[body].inertia] * v[2] * v[2];
  }
  return energy;
}

double PotentialEnergy(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  double energy = 0.0;
  for (const int body : s.moving) {
    energy -=
        model.numbers[s.bodies[body].mass] * (model.numbers[kGravityX] * state.pose[3 * body] +
                                              model.numbers[kGravityY] * state.pose[3 * body + 1]);
  }
  for (const SpringIndex& spring : s.springs) {
    SpringRow<double> row;
    EvaluateSpring(state.PoseOf(spring.a), state.PoseOf(spring.b), &model.numbers[spring.numbers],
                   &row);
    energy += 0.5 * row.tension * (row.length - model.numbers[spring.numbers + 6]);
  }
  return energy;
}

Vector3<double> Momentum(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  Vector3<double> sum = Vector3<double>::Zero();
  for (const int body : s.moving) {
    const double* x = &state.pose[3 * body];
    const double* v = &state.twist[3 * body];
    const double mass = model.numbers[s.bodies[body].mass];
    sum += Vector3<double>(
        mass * v[0], mass * v[1],
        mass * (x[0] * v[1] - x[1] * v[0]) + model.numbers[s.bodies[body].inertia] * v[2]);
  }
  return sum;
}

double SmallestGap(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  double smallest = std::numeric_limits<double>::infinity();
  for (int a = 0; a < s.num_bodies(); ++a) {
    for (int b = a + 1; b < s.num_bodies(); ++b) {
      if (!s.MayCollide(a, b)) {
        continue;
      }
      ContactFeature features[2];
      const ShapeView<double> shape_a = model.Shape(a);
      const ShapeView<double> shape_b = model.Shape(b);
      const Pose<double> pose_a = state.PoseOf(a);
      const Pose<double> pose_b = state.PoseOf(b);
      const int count = FindContactFeatures(shape_a, pose_a, shape_b, pose_b,
                                            std::numeric_limits<double>::infinity(), features);
      for (int k = 0; k < count; ++k) {
        const double gap = EvaluateContact(features[k], shape_a, pose_a, shape_b, pose_b).gap;
        smallest = std::min(smallest, gap);
      }
    }
  }
  return smallest;
}

int CountIslands(const ModelStructure& structure, const StepRecord& record) {
  std::vector<int> parent(structure.num_blocks());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) {
      parent[i] = parent[parent[i]];
      i = parent[i];
    }
    return i;
  };
  const auto join = [&](int a, int b) {
    if (a >= 0 && b >= 0) {
      parent[root(a)] = root(b);
    }
  };
  for (const SpringIndex& spring : structure.springs) {
    join(structure.bodies[spring.a].block, structure.bodies[spring.b].block);
  }
  for (const JointIndex& joint : structure.joints) {
    join(structure.bodies[joint.a].block, structure.bodies[joint.b].block);
  }
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    if (record.solution.modes[i] != ContactMode::kOpen) {
      join(structure.bodies[record.contacts[i].a].block,
           structure.bodies[record.contacts[i].b].block);
    }
  }
  int islands = 0;
  for (int i = 0; i < structure.num_blocks(); ++i) {
    islands += parent[i] == i ? 1 : 0;
  }
  return islands;
}

}  // namespace tangible
