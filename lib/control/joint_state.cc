// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/joint_state.h"

#include "tangible/control/tolerances.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/scalar.h"

namespace tangible {

JointState::JointState(const Model<double>& model) : model_(model) {
  for (const int body : model_.structure->moving) {
    model_.parameters[model_.structure->bodies[body].inertia] *= kTurnWeight;
  }
}

JointState::Outcome JointState::Project(State<double>* state) {
  error_ = JointDrift(model_, *state);
  if (error_ <= kOffJoints) return Outcome::kOnJoints;
  const std::vector<double> start = state->pose;
  if (!projection_.Project(model_, start, state)) return Outcome::kFailed;
  ProjectTwists(state);
  return Outcome::kProjected;
}

void JointState::ProjectTwists(State<double>* state) const {
  const ModelStructure& s = *model_.structure;
  Eigen::Index count = 0;
  for (const JointIndex& joint : s.joints) count += joint.rows;
  const auto columns = static_cast<Eigen::Index>(3 * s.moving.size());
  // Of u = W^½ (v − ṽ): the least of its solutions is the nearest twist, redundant rows or not.
  MatrixX<double> rows = MatrixX<double>::Zero(count, columns);
  VectorX<double> roots(columns), rates(count);
  for (const int body : s.moving) {
    const BodyIndex& index = s.bodies[body];
    const double mass = model_.parameters[index.mass];
    roots.segment<3>(3 * index.block) << mass, mass, model_.parameters[index.inertia];
  }
  roots = roots.cwiseSqrt();
  Eigen::Index at = 0;
  for (const JointIndex& joint : s.joints) {
    JointRows<double> of;
    EvaluateJoint(model_, *state, joint, &of);
    for (int k = 0; k < of.rows; ++k, ++at) {
      rates[at] = 0.0;
      for (const auto& [body, row] : {std::pair(joint.a, of.row_a[k]), {joint.b, of.row_b[k]}}) {
        const int block = s.bodies[body].block;
        for (int i = 0; i < 3; ++i) {
          rates[at] += row[i] * state->twist[3 * body + i];
          if (block >= 0) rows(at, 3 * block + i) += row[i] / roots[3 * block + i];
        }
      }
      if (joint.c < 0) continue;
      for (const auto& [body, row] : {std::pair(joint.c, of.row_c), {joint.d, of.row_d}}) {
        const int block = s.bodies[body].block;
        for (int i = 0; i < 3; ++i) {
          rates[at] += row[i] * state->twist[3 * body + i];
          if (block >= 0) rows(at, 3 * block + i) += row[i] / roots[3 * block + i];
        }
      }
    }
  }
  const VectorX<double> change = OrthogonalDecomposition(rows).Solve(VectorX<double>(-rates));
  for (const int body : s.moving) {
    const int block = s.bodies[body].block;
    for (int i = 0; i < 3; ++i) {
      state->twist[3 * body + i] += change[3 * block + i] / roots[3 * block + i];
    }
  }
}

}  // namespace tangible
