// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/joint_projection.h"

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

// Newton converges quadratically; more iterations mean that the joints cannot hold.
constexpr int kMaxIterations = 30;
// Of a redundant joint's row (a closed loop), as in ContactSystem; Newton's iteration absorbs it.
constexpr double kRegularisation = 1e-10;

template <typename T>
void EvaluateAll(const Model<T>& model, const State<T>& state, std::vector<JointRows<T>>* rows) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  rows->resize(joints.size());
  for (size_t j = 0; j < joints.size(); ++j) {
    EvaluateJoint(joints[j].type, state.PoseOf(joints[j].a), state.PoseOf(joints[j].b),
                  &model.numbers[joints[j].geometry], &(*rows)[j]);
  }
}

template <typename T>
double LargestError(const std::vector<JointRows<T>>& rows) {
  double largest = 0.0;
  for (const JointRows<T>& row : rows) {
    for (int k = 0; k < row.rows; ++k) {
      const double error = std::abs(ValueOf(row.error[k]));
      largest = std::isnan(error) ? HUGE_VAL : std::max(largest, error);
    }
  }
  return largest;
}

void JointEdges(const ModelStructure& structure, std::vector<std::pair<int, int>>* edges) {
  edges->clear();
  int block = structure.num_blocks();
  for (const JointIndex& joint : structure.joints) {
    for (const int body : {joint.a, joint.b}) {
      if (structure.bodies[body].block >= 0) {
        edges->emplace_back(structure.bodies[body].block, block);
      }
    }
    ++block;
  }
}

// [M −A(q̃)ᵀ; A(q) δ], factorised.
template <typename T>
bool FactorProjection(const Model<T>& model, const std::vector<JointRows<T>>& from,
                      const std::vector<JointRows<T>>& at,
                      const std::vector<std::pair<int, int>>& edges, BlockLu<T>* lu) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  lu->SetPattern(nb + static_cast<int>(s.joints.size()), nb, edges);
  lu->SetZero();
  for (int k = 0; k < nb; ++k) {
    const BodyIndex& body = s.bodies[s.moving[k]];
    lu->Diagonal(k)[0] = lu->Diagonal(k)[4] = model.numbers[body.mass];
    lu->Diagonal(k)[8] = model.numbers[body.inertia];
  }
  int edge = 0;
  for (size_t j = 0; j < s.joints.size(); ++j) {
    T* diagonal = lu->Diagonal(nb + static_cast<int>(j));
    for (int r = 0; r < 3; ++r) {
      diagonal[4 * r] = T(r >= at[j].rows ? 1.0 : 0.0);
    }
    const auto add = [&](int body, const RowPart<T>* from_rows, const RowPart<T>* at_rows) {
      const BodyIndex& index = s.bodies[body];
      if (index.block < 0) {
        return;
      }
      for (int r = 0; r < at[j].rows; ++r) {
        for (int i = 0; i < 3; ++i) {
          lu->SecondFirst(edge)[3 * r + i] = at_rows[r][i];
          lu->FirstSecond(edge)[3 * i + r] = -from_rows[r][i];
        }
        if (s.joint_loops) {
          const double mass = ValueOf(model.numbers[index.mass]);
          diagonal[4 * r] += kRegularisation / mass;
        }
      }
      ++edge;
    };
    add(s.joints[j].a, from[j].row_a, at[j].row_a);
    add(s.joints[j].b, from[j].row_b, at[j].row_b);
  }
  return lu->Factor();
}

// One Newton step: rhs, solve, update of poses and multipliers.
template <typename T>
void NewtonStep(const Model<T>& model, const State<T>& from,
                const std::vector<JointRows<T>>& rows_from, const std::vector<JointRows<T>>& rows,
                BlockLu<T>* lu, std::vector<T>* rhs, std::vector<T>* multipliers, State<T>* state) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  rhs->assign(3 * (nb + s.joints.size()), T(0.0));
  for (int k = 0; k < nb; ++k) {
    const int body = s.moving[k];
    const BodyIndex& index = s.bodies[body];
    for (int i = 0; i < 3; ++i) {
      const T& mass = model.numbers[i < 2 ? index.mass : index.inertia];
      (*rhs)[3 * k + i] = -mass * (state->pose[3 * body + i] - from.pose[3 * body + i]);
    }
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const int a = s.bodies[s.joints[j].a].block;
    const int b = s.bodies[s.joints[j].b].block;
    for (int r = 0; r < rows[j].rows; ++r) {
      AddRowTransposed(a, rows_from[j].row_a[r], b, rows_from[j].row_b[r],
                       (*multipliers)[3 * j + r], rhs->data());
      (*rhs)[3 * (nb + j) + r] = -rows[j].error[r];
    }
  }
  lu->Solve(rhs->data(), 1);
  for (int k = 0; k < nb; ++k) {
    for (int i = 0; i < 3; ++i) {
      state->pose[3 * s.moving[k] + i] += (*rhs)[3 * k + i];
    }
  }
  for (size_t i = 0; i < multipliers->size(); ++i) {
    (*multipliers)[i] += (*rhs)[3 * nb + i];
  }
}

}  // namespace

double JointDrift(const Model<double>& model, const State<double>& state) {
  double largest = 0.0;
  for (const JointIndex& joint : model.structure->joints) {
    JointRows<double> rows;
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.numbers[joint.geometry], &rows);
    for (int k = 0; k < rows.rows; ++k) {
      largest = std::max(largest, std::abs(rows.error[k]));
    }
  }
  return largest;
}

bool JointProjection::Project(const Model<double>& model, State<double>* state) {
  const double tolerance = model.structure->settings.joint_tolerance;
  from_ = *state;
  multipliers_.assign(3 * model.structure->joints.size(), 0.0);
  JointEdges(*model.structure, &edges_);
  EvaluateAll(model, from_, &rows_from_);
  rows_to_ = rows_from_;
  error_ = LargestError(rows_to_);
  bool met = error_ <= tolerance;
  // On, past the tolerance, while it helps: derivatives hold at C = 0, and quadratic convergence
  // makes the last digits cheap.
  for (int i = 0; i < kMaxIterations && std::isfinite(error_); ++i) {
    if (!FactorProjection(model, rows_from_, rows_to_, edges_, &lu_)) {
      return false;
    }
    NewtonStep(model, from_, rows_from_, rows_to_, &lu_, &rhs_, &multipliers_, state);
    EvaluateAll(model, *state, &rows_to_);
    const double before = error_;
    error_ = LargestError(rows_to_);
    met = met || error_ <= tolerance;
    if (met && !(error_ < 0.1 * before && error_ > 1e-15)) {
      break;
    }
  }
  to_ = *state;
  return met && error_ <= tolerance;
}

void JointProjection::Factor(const Model<double>& model) {
  FactorProjection(model, rows_from_, rows_to_, edges_, &lu_);
}

// Entries of ∂(R1, R2)/∂w at fixed q⁺, μ:
//   R1 = M (q⁺ − q̃) − A(q̃)ᵀ μ,   R2 = C(q⁺; prescribed poses, numbers).
template <typename Sink>
void JointProjection::Visit(const Model<double>& model, const Sink& sink) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  for (int k = 0; k < nb; ++k) {
    const int body = s.moving[k];
    const BodyIndex& index = s.bodies[body];
    for (int i = 0; i < 3; ++i) {
      const int mass = i < 2 ? index.mass : index.inertia;
      sink(3 * k + i, s.NumberVariable(mass), to_.pose[3 * body + i] - from_.pose[3 * body + i]);
      sink(3 * k + i, s.PoseVariable(body, i), -model.numbers[mass]);
    }
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointIndex& joint = s.joints[j];
    // Locals: pose of a, pose of b, geometry.
    int variables[kLocalJetWidth];
    for (int i = 0; i < 3; ++i) {
      variables[i] = s.PoseVariable(joint.a, i);
      variables[3 + i] = s.PoseVariable(joint.b, i);
    }
    LocalJet numbers[7];
    for (int i = 0; i < joint.num_geometry; ++i) {
      variables[6 + i] = s.NumberVariable(joint.geometry + i);
      numbers[i] = LocalJet(model.numbers[joint.geometry + i], 6 + i);
    }
    const int count = 6 + joint.num_geometry;
    const auto pose = [&](const State<double>& state, int body, int first) {
      const double* q = &state.pose[3 * body];
      return Pose<LocalJet>(Vector2<LocalJet>(LocalJet(q[0], first), LocalJet(q[1], first + 1)),
                            LocalJet(q[2], first + 2));
    };
    JointRows<LocalJet> from, to;
    EvaluateJoint(joint.type, pose(from_, joint.a, 0), pose(from_, joint.b, 3), numbers, &from);
    EvaluateJoint(joint.type, pose(to_, joint.a, 0), pose(to_, joint.b, 3), numbers, &to);
    const int a = s.bodies[joint.a].block;
    const int b = s.bodies[joint.b].block;
    for (int r = 0; r < to.rows; ++r) {
      const double mu = multipliers_[3 * j + r];
      const int row = 3 * (nb + static_cast<int>(j)) + r;
      for (int v = 0; v < count; ++v) {
        // At fixed q⁺ of moving bodies, C depends on prescribed poses and numbers alone.
        const bool unknown = (v < 3 && a >= 0) || (v >= 3 && v < 6 && b >= 0);
        if (!unknown) {
          sink(row, variables[v], to.error[r].v[v]);
        }
        for (int i = 0; i < 3; ++i) {
          if (a >= 0) {
            sink(3 * a + i, variables[v], -mu * from.row_a[r][i].v[v]);
          }
          if (b >= 0) {
            sink(3 * b + i, variables[v], -mu * from.row_b[r][i].v[v]);
          }
        }
      }
    }
  }
}

void JointProjection::Tangent(const Model<double>& model, double* w_dot, int columns) {
  const ModelStructure& s = *model.structure;
  Factor(model);
  rhs_.assign(3 * (s.num_blocks() + s.joints.size()) * static_cast<size_t>(columns), 0.0);
  Visit(model, TangentSink{w_dot, rhs_.data(), columns});
  lu_.Solve(rhs_.data(), columns);
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(&rhs_[3 * static_cast<size_t>(k) * columns], 3 * columns,
                w_dot + static_cast<size_t>(s.PoseVariable(s.moving[k], 0)) * columns);
  }
}

void JointProjection::Adjoint(const Model<double>& model, double* w_bar, int columns) {
  const ModelStructure& s = *model.structure;
  Factor(model);
  rhs_.assign(3 * (s.num_blocks() + s.joints.size()) * static_cast<size_t>(columns), 0.0);
  for (int k = 0; k < s.num_blocks(); ++k) {
    double* pose = w_bar + static_cast<size_t>(s.PoseVariable(s.moving[k], 0)) * columns;
    std::copy_n(pose, 3 * columns, &rhs_[3 * static_cast<size_t>(k) * columns]);
    std::fill_n(pose, 3 * columns, 0.0);
  }
  lu_.SolveTransposed(rhs_.data(), columns);
  Visit(model, AdjointSink{rhs_.data(), w_bar, columns});
}

template <typename T>
void JointProjection::ProjectUnrolled(const Model<T>& model, State<T>* state) {
  const State<T> from = *state;
  std::vector<JointRows<T>> rows_from, rows;
  std::vector<std::pair<int, int>> edges;
  std::vector<T> rhs;
  std::vector<T> multipliers(3 * model.structure->joints.size(), T(0.0));
  BlockLu<T> lu;
  JointEdges(*model.structure, &edges);
  EvaluateAll(model, from, &rows_from);
  rows = rows_from;
  double error = LargestError(rows);
  // Derivatives converge one step behind values: two more steps after these have.
  int extra = 2;
  for (int i = 0; i < kMaxIterations && extra > 0; ++i) {
    if (!FactorProjection(model, rows_from, rows, edges, &lu)) {
      return;
    }
    NewtonStep(model, from, rows_from, rows, &lu, &rhs, &multipliers, state);
    EvaluateAll(model, *state, &rows);
    const double before = error;
    error = LargestError(rows);
    if (!(error < 0.1 * before && error > 1e-15)) {
      --extra;
    }
  }
}

#define TANGIBLE_INSTANTIATE_JET(N) \
  template void JointProjection::ProjectUnrolled<Jet<N>>(const Model<Jet<N>>&, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
