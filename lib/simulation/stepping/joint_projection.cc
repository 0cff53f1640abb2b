// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/joint_projection.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/joint_coupling_inl.h"
#include "tangible/simulation/stepping/projection_descent.h"

namespace tangible {
namespace {

// Squared norm of each column; x is row-major.
std::vector<double> SquaredNorms(const std::vector<double>& x, int columns) {
  std::vector<double> sums(columns, 0.0);
  for (size_t i = 0; i < x.size(); ++i) {
    sums[i % columns] += x[i] * x[i];
  }
  return sums;
}

}  // namespace

double JointDrift(const Model<double>& model, const State<double>& state) {
  double largest = 0.0;
  for (const JointIndex& joint : model.structure->joints) {
    JointRows<double> rows;
    EvaluateJoint(model, state, joint, &rows);
    for (int k = 0; k < rows.rows; ++k) {
      largest = std::max(largest, std::abs(rows.error[k]));
    }
  }
  return largest;
}

bool JointProjection::Project(const Model<double>& model, const std::vector<double>& start,
                              State<double>* state) {
  iterate_.from = *state;
  iterate_.at = *state;
  const bool met =
      IterateProjection(model, 0, &iterate_) || DescendToProjection(model, start, &iterate_);
  state->pose = iterate_.at.pose;
  return met;
}

size_t JointProjection::bytes() const {
  size_t numbers = iterate_.multipliers.capacity() + iterate_.rhs.capacity() + rhs_.capacity() +
                   solution_.capacity();
  for (const State<double>* state : {&iterate_.from, &iterate_.at, &iterate_.trial}) {
    numbers += state->pose.capacity() + state->twist.capacity();
  }
  return sizeof(double) * numbers +
         sizeof(JointRows<double>) * (iterate_.rows.capacity() + iterate_.trial_rows.capacity()) +
         sizeof(JointCurvature<double>) *
             (iterate_.curvature.capacity() + iterate_.second_curvature.capacity()) +
         sizeof(iterate_.edges[0]) * iterate_.edges.capacity() + iterate_.lu.bytes();
}

int JointProjection::worst_joint() const {
  const auto worst = std::max_element(iterate_.rows.begin(), iterate_.rows.end(),
                                      [](const JointRows<double>& x, const JointRows<double>& y) {
                                        return LargestError(x) < LargestError(y);
                                      });
  return worst == iterate_.rows.end() ? -1 : static_cast<int>(worst - iterate_.rows.begin());
}

// Visits the entries of ∂(R1, R2)/∂w at fixed q⁺, μ:
//   R1 = M (q⁺ − q̃) − A(q⁺)ᵀ μ,   R2 = C(q⁺), of prescribed poses and numbers.
template <typename Sink>
void JointProjection::Visit(const Model<double>& model, const Sink& sink) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  const State<double>& at = iterate_.at;
  for (int k = 0; k < nb; ++k) {
    const int body = s.moving[k];
    const BodyIndex& index = s.bodies[body];
    for (int i = 0; i < 3; ++i) {
      const int mass = i < 2 ? index.mass : index.inertia;
      sink(3 * k + i, s.ParameterVariable(mass),
           at.pose[3 * body + i] - iterate_.from.pose[3 * body + i]);
      sink(3 * k + i, s.PoseVariable(body, i), -model.parameters[mass]);
    }
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointIndex& joint = s.joints[j];
    if (IsReleased(at, static_cast<int>(j))) continue;
    for (int k = 0; k < (joint.IsCoupling() ? 2 : 1); ++k) {
      VisitShare(model, static_cast<int>(j), k, sink);
    }
  }
}

// Those of joint j, or of the share of coordinate k of a coupling.
template <typename Sink>
void JointProjection::VisitShare(const Model<double>& model, int j, int k, const Sink& sink) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  const State<double>& at = iterate_.at;
  const bool couples = s.joints[j].IsCoupling();
  const JointIndex& joint = couples ? s.joints[s.joints[j].coupled[k]] : s.joints[j];
  // Locals: pose of a, pose of b, geometry.
  int variables[kLocalJetWidth];
  for (int i = 0; i < 3; ++i) {
    variables[i] = s.PoseVariable(joint.a, i);
    variables[3 + i] = s.PoseVariable(joint.b, i);
  }
  LocalJet numbers[7];
  for (int i = 0; i < joint.num_geometry; ++i) {
    variables[6 + i] = s.ParameterVariable(joint.geometry + i);
    numbers[i] = LocalJet(model.parameters[joint.geometry + i], 6 + i);
  }
  int count = 6 + joint.num_geometry;
  const auto pose = [&](int body, int first) {
    const double* q = &at.pose[3 * body];
    return Pose<LocalJet>(Vector2<LocalJet>(LocalJet(q[0], first), LocalJet(q[1], first + 1)),
                          LocalJet(q[2], first + 2));
  };
  JointRows<LocalJet> rows;
  EvaluateJoint(joint.type, pose(joint.a, 0), pose(joint.b, 3), numbers, &rows);
  if (couples) {
    const int number = s.joints[j].geometry + (k == 0 ? 1 : 0);
    variables[count] = s.ParameterVariable(number);
    const LocalJet local(model.parameters[number], count++);
    const LocalJet of_coupling[2] = {local, local};
    ScaleToShare(s.joints[j].type, k, of_coupling, &rows);
  }
  const int a = s.bodies[joint.a].block;
  const int b = s.bodies[joint.b].block;
  for (int v = 0; v < count; ++v) {
    if ((v < 3 && a >= 0) || (v >= 3 && v < 6 && b >= 0)) {
      continue;  // a moving body's pose is an unknown: in K
    }
    for (int r = 0; r < rows.rows; ++r) {
      const double mu = iterate_.multipliers[3 * static_cast<size_t>(j) + r];
      sink(3 * (nb + j) + r, variables[v], rows.error[r].v[v]);
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) {
          sink(3 * a + i, variables[v], -mu * rows.row_a[r][i].v[v]);
        }
        if (b >= 0) {
          sink(3 * b + i, variables[v], -mu * rows.row_b[r][i].v[v]);
        }
      }
    }
  }
}

// x := K⁻¹ x, refined where the factorised matrix was shifted or regularised; each column is
// refined as long as its residual falls.
void JointProjection::SolveRefined(const Model<double>& model, std::vector<double>* x,
                                   int columns) {
  FactorProjection(model, &iterate_);
  if (!iterate_.shifted && !model.structure->joint_loops) {
    iterate_.lu.Solve(x->data(), columns);
    return;
  }
  const std::vector<double> rhs = *x;
  std::vector<double> residual = rhs;
  iterate_.lu.Solve(x->data(), columns);
  solution_ = *x;
  SubtractProjectionMatrix(model, iterate_, x->data(), columns, residual.data());
  std::vector<double> norms = SquaredNorms(residual, columns);
  std::vector<bool> falls(columns, true);
  for (bool any = true; any;) {
    iterate_.lu.Solve(residual.data(), columns);
    *x = solution_;
    for (size_t i = 0; i < x->size(); ++i) {
      (*x)[i] += residual[i];
    }
    residual = rhs;
    SubtractProjectionMatrix(model, iterate_, x->data(), columns, residual.data());
    const std::vector<double> lower = SquaredNorms(residual, columns);
    any = false;
    for (int c = 0; c < columns; ++c) {
      falls[c] = falls[c] && lower[c] < 0.25 * norms[c];
      any = any || falls[c];
    }
    for (size_t i = 0; i < x->size(); ++i) {
      const size_t c = i % columns;
      if (falls[c]) {
        solution_[i] = (*x)[i];
      }
    }
    norms = lower;
  }
  *x = solution_;
}

void JointProjection::Tangent(const Model<double>& model, double* w_dot, int columns) {
  const ModelStructure& s = *model.structure;
  rhs_.assign(3 * (s.num_blocks() + s.joints.size()) * static_cast<size_t>(columns), 0.0);
  Visit(model, TangentSink{w_dot, rhs_.data(), columns});
  SolveRefined(model, &rhs_, columns);
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(&rhs_[3 * static_cast<size_t>(k) * columns], 3 * columns,
                w_dot + static_cast<size_t>(s.PoseVariable(s.moving[k], 0)) * columns);
  }
}

void JointProjection::Adjoint(const Model<double>& model, double* w_bar, int columns) {
  const ModelStructure& s = *model.structure;
  const size_t bodies = 3 * static_cast<size_t>(s.num_blocks()) * columns;
  rhs_.assign(3 * (s.num_blocks() + s.joints.size()) * static_cast<size_t>(columns), 0.0);
  for (int k = 0; k < s.num_blocks(); ++k) {
    double* pose = w_bar + static_cast<size_t>(s.PoseVariable(s.moving[k], 0)) * columns;
    std::copy_n(pose, 3 * columns, &rhs_[3 * static_cast<size_t>(k) * columns]);
    std::fill_n(pose, 3 * columns, 0.0);
  }
  // Kᵀ is K with the sign of the multipliers' rows and columns changed; their right-hand side is 0.
  SolveRefined(model, &rhs_, columns);
  for (size_t i = bodies; i < rhs_.size(); ++i) {
    rhs_[i] = -rhs_[i];
  }
  Visit(model, AdjointSink{rhs_.data(), w_bar, columns});
}

template <typename T>
void JointProjection::ProjectUnrolled(const Model<T>& model, const std::vector<double>& start,
                                      State<T>* state) {
  ProjectionIterate<T> iterate;
  iterate.from = *state;
  iterate.at = *state;
  // Derivatives converge one step later than values: two more steps follow after convergence of the
  // values.
  constexpr int kExtra = 2;
  if (!IterateProjection(model, kExtra, &iterate)) {
    // The path to the minimum does not enter the derivatives: it ends where Newton's method
    // converges.
    Model<double> values{model.structure, {}};
    for (const T& number : model.parameters) {
      values.parameters.push_back(number.a);
    }
    ProjectionIterate<double> descent;
    descent.from = ValuesOf(*state);
    descent.at = descent.from;
    IterateProjection(values, 0, &descent);
    DescendToProjection(values, start, &descent);
    for (const int body : model.structure->moving) {
      for (int i = 3 * body; i < 3 * body + 3; ++i) {
        iterate.at.pose[i] = T(descent.at.pose[i]);
      }
    }
    for (size_t i = 0; i < descent.multipliers.size(); ++i) {
      iterate.multipliers[i] = T(descent.multipliers[i]);
    }
    ResumeProjection(model, kMostOfDescent, kExtra, &iterate);
  }
  state->pose = iterate.at.pose;
}

#define TANGIBLE_INSTANTIATE_JET(N)                       \
  template void JointProjection::ProjectUnrolled<Jet<N>>( \
      const Model<Jet<N>>&, const std::vector<double>&, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
