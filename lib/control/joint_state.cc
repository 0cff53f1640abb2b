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

JointState::Rows JointState::RowsAt(const State<double>& state) const {
  const ModelStructure& s = *model_.structure;
  Eigen::Index count = 0;
  for (const JointIndex& joint : s.joints) count += joint.rows;
  const auto columns = static_cast<Eigen::Index>(3 * s.moving.size());
  Rows of{MatrixX<double>::Zero(count, columns), VectorX<double>::Zero(count),
          VectorX<double>(columns)};
  for (const int body : s.moving) {
    const BodyIndex& index = s.bodies[body];
    const double mass = model_.parameters[index.mass];
    of.roots.segment<3>(3 * index.block) << mass, mass, model_.parameters[index.inertia];
  }
  of.roots = of.roots.cwiseSqrt();
  Eigen::Index at = 0;
  const auto add = [&](int body, const RowPart<double>& row) {
    const int block = s.bodies[body].block;
    for (int i = 0; i < 3; ++i) {
      of.rates[at] += row[i] * state.twist[3 * body + i];
      if (block >= 0) of.rows(at, 3 * block + i) += row[i] / of.roots[3 * block + i];
    }
  };
  for (const JointIndex& joint : s.joints) {
    JointRows<double> rows;
    EvaluateJoint(model_, state, joint, &rows);
    for (int k = 0; k < rows.rows; ++k, ++at) {
      add(joint.a, rows.row_a[k]);
      add(joint.b, rows.row_b[k]);
      if (joint.c < 0) continue;
      add(joint.c, rows.row_c);
      add(joint.d, rows.row_d);
    }
  }
  return of;
}

void JointState::ProjectTwists(State<double>* state) const {
  const ModelStructure& s = *model_.structure;
  // Of u = W^½ (v − ṽ): the least of its solutions is the nearest twist, redundant rows or not.
  const Rows of = RowsAt(*state);
  const VectorX<double> change = OrthogonalDecomposition(of.rows).Solve(VectorX<double>(-of.rates));
  for (const int body : s.moving) {
    const int block = s.bodies[body].block;
    for (int i = 0; i < 3; ++i) {
      state->twist[3 * body + i] += change[3 * block + i] / of.roots[3 * block + i];
    }
  }
}

MatrixX<double> JointState::Projector(const State<double>& state) const {
  const Rows of = RowsAt(state);
  const Eigen::Index n = of.roots.size();
  MatrixX<double> projector = MatrixX<double>::Identity(n, n);
  if (of.rows.rows() > 0) projector -= OrthogonalDecomposition(of.rows).Solve(of.rows);
  return of.roots.cwiseInverse().asDiagonal() * projector * of.roots.asDiagonal();
}

}  // namespace tangible
