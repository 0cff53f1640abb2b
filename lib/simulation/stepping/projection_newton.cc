// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/projection_newton.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// Newton converges quadratically, in 2 to 3 steps in the median and 11 at a drift of two lengths of
// a link; more steps mean that the joints cannot be satisfied.
constexpr int kMaxIterations = 60;

template <typename T>
void EvaluateAll(const Model<T>& model, const State<T>& state, std::vector<JointRows<T>>* rows) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  rows->resize(joints.size());
  for (size_t j = 0; j < joints.size(); ++j) {
    EvaluateJoint(model, state, joints[j], &(*rows)[j]);
  }
}

template <typename T>
double LargestError(const std::vector<JointRows<T>>& rows) {
  double largest = 0.0;
  for (const JointRows<T>& row : rows) {
    largest = std::max(largest, LargestError(row));
  }
  return largest;
}

// Whether all joints are satisfied to a tolerance (m or rad), plus rounding.
template <typename T>
bool Hold(const Model<T>& model, const State<T>& state, const std::vector<JointRows<T>>& rows,
          double error, double tolerance) {
  if (error <= tolerance) return true;
  for (size_t j = 0; j < rows.size(); ++j) {
    const JointIndex& joint = model.structure->joints[j];
    for (int k = 0; k < rows[j].rows; ++k) {
      const double coordinate =
          IsAngle(joint, k) ? AngleOf(state, joint.a, joint.b) : PlaceOf(state, joint.a, joint.b);
      if (!(std::abs(ValueOf(rows[j].error[k])) <= tolerance + kCoordinateRounding * coordinate)) {
        return false;
      }
    }
  }
  return true;
}

double Determinant(const double* w) {
  return w[0] * (w[4] * w[8] - w[5] * w[7]) - w[1] * (w[3] * w[8] - w[5] * w[6]) +
         w[2] * (w[3] * w[7] - w[4] * w[6]);
}

// The edges of each joint with its moving bodies, and of these with each other where its curvature
// couples them.
void JointEdges(const ModelStructure& structure, std::vector<std::pair<int, int>>* edges) {
  edges->clear();
  int block = structure.num_blocks();
  for (const JointIndex& joint : structure.joints) {
    for (const int end : {joint.a, joint.b, joint.c, joint.d}) {
      const int body = end < 0 ? -1 : structure.bodies[end].block;
      if (body >= 0) {
        edges->emplace_back(body, block);
      }
    }
    for (int k = 0; k < NumShares(joint); ++k) {
      if (!CouplesBodies(structure, joint, k)) continue;
      const JointIndex& of = ShareOf(structure, joint, k);
      edges->emplace_back(structure.bodies[of.a].block, structure.bodies[of.b].block);
    }
    ++block;
  }
}

template <typename T>
const T& MassOf(const Model<T>& model, int body, int i) {
  const BodyIndex& index = model.structure->bodies[body];
  return model.parameters[i < 2 ? index.mass : index.inertia];
}

// Whether a matrix of 3 x 3 is positive definite by Sylvester's criterion, with its determinant
// above a bound.
bool IsPositive(const double* w, double least) {
  const double minor = w[0] * w[4] - w[1] * w[3];
  return w[0] > 0.0 && minor > 0.0 && Determinant(w) > least;
}

// Adds the weight to the matrix's diagonal; the blocks of W between bodies are added with their
// joint.
template <typename T>
void AddBodies(const Model<T>& model, ProjectionWeight weight, ProjectionIterate<T>* p) {
  const ModelStructure& s = *model.structure;
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      p->lu.Diagonal(k)[4 * i] = MassOf(model, s.moving[k], i);
    }
  }
  p->shifted = false;
  if (weight == ProjectionWeight::kMass) {
    return;
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    for (int k = 0; k < NumShares(s.joints[j]); ++k) {
      const JointIndex& of = ShareOf(s, s.joints[j], k);
      const JointCurvature<T>& curvature = CurvatureOf(*p, j, k);
      const int a = s.bodies[of.a].block;
      const int b = s.bodies[of.b].block;
      for (int i = 0; i < 9; ++i) {
        if (a >= 0) {
          p->lu.Diagonal(a)[i] -= curvature.aa[i];
        }
        if (b >= 0) {
          p->lu.Diagonal(b)[i] -= curvature.bb[i];
        }
      }
    }
  }
  for (int k = 0; k < s.num_blocks(); ++k) {
    double w[9];
    double scale = 1.0;
    for (int i = 0; i < 9; ++i) {
      w[i] = ValueOf(p->lu.Diagonal(k)[i]);
    }
    for (int i = 0; i < 3; ++i) {
      scale *= ValueOf(MassOf(model, s.moving[k], i));
    }
    if (weight == ProjectionWeight::kConvex) {
      for (int i = 0; i < 9 && !IsPositive(w, kSingularBlock * scale); ++i) {
        p->lu.Diagonal(k)[i] = i % 4 == 0 ? MassOf(model, s.moving[k], i / 4) : T(0.0);
      }
    } else if (std::abs(Determinant(w)) < kSingularBlock * scale) {
      p->shifted = true;
      for (int i = 0; i < 3; ++i) {
        p->lu.Diagonal(k)[4 * i] += 2.0 * kSingularBlock * MassOf(model, s.moving[k], i);
      }
    }
  }
}

// Factorises the matrix (2) with a weight; except for the weight M, EvaluateCurvatures must have
// been called.
template <typename T>
bool FactorMatrix(const Model<T>& model, ProjectionWeight weight, ProjectionIterate<T>* p) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  BlockLu<T>& lu = p->lu;
  lu.SetPattern(nb + static_cast<int>(s.joints.size()), nb, p->edges);
  lu.SetZero();
  AddBodies(model, weight, p);
  int edge = 0;
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointRows<T>& rows = p->rows[j];
    T* diagonal = lu.Diagonal(nb + static_cast<int>(j));
    for (int r = 0; r < 3; ++r) {
      diagonal[4 * r] = T(r >= rows.rows ? 1.0 : 0.0);
    }
    const auto add = [&](int body, const RowPart<T>* row) {
      if (s.bodies[body].block < 0) {
        return;
      }
      for (int r = 0; r < rows.rows; ++r) {
        for (int i = 0; i < 3; ++i) {
          lu.SecondFirst(edge)[3 * r + i] = row[r][i];
          lu.FirstSecond(edge)[3 * i + r] = -row[r][i];
        }
        if (s.joint_loops) {
          // Newton's iteration compensates for this term.
          diagonal[4 * r] += kContactRegularisation / ValueOf(MassOf(model, body, 0));
        }
      }
      ++edge;
    };
    const JointIndex& joint = s.joints[j];
    add(joint.a, rows.row_a);
    add(joint.b, rows.row_b);
    if (joint.c >= 0) {
      add(joint.c, &rows.row_c);
      add(joint.d, &rows.row_d);
    }
    for (int k = 0; k < NumShares(joint); ++k) {
      if (!CouplesBodies(s, joint, k)) continue;
      for (int i = 0; i < 9 && weight == ProjectionWeight::kExact; ++i) {
        const T& entry = CurvatureOf(*p, j, k).ab[i];
        lu.FirstSecond(edge)[i] -= entry;
        lu.SecondFirst(edge)[3 * (i % 3) + i / 3] -= entry;
      }
      ++edge;
    }
  }
  return lu.Factor();
}

template <typename T>
void EvaluateCurvatures(const Model<T>& model, ProjectionIterate<T>* p) {
  const std::vector<JointIndex>& joints = model.structure->joints;
  p->curvature.resize(joints.size());
  for (size_t j = 0; j < joints.size(); ++j) {
    EvaluateJointCurvature(model, p->at, joints[j], 0, &p->multipliers[3 * j], &p->curvature[j]);
    if (!joints[j].IsCoupling()) continue;
    p->second_curvature.resize(joints.size());
    EvaluateJointCurvature(model, p->at, joints[j], 1, &p->multipliers[3 * j],
                           &p->second_curvature[j]);
  }
}

// p->rhs becomes a Newton step of poses and multipliers; returns its size in radii of gyration.
template <typename T>
double SolveStep(const Model<T>& model, ProjectionIterate<T>* p) {
  const ModelStructure& s = *model.structure;
  const int nb = s.num_blocks();
  p->rhs.assign(3 * (nb + s.joints.size()), T(0.0));
  for (int k = 0; k < nb; ++k) {
    const int body = s.moving[k];
    for (int i = 0; i < 3; ++i) {
      p->rhs[3 * k + i] =
          -MassOf(model, body, i) * (p->at.pose[3 * body + i] - p->from.pose[3 * body + i]);
    }
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointRows<T>& rows = p->rows[j];
    for (int r = 0; r < rows.rows; ++r) {
      AddRowTransposed(s.bodies[s.joints[j].a].block, rows.row_a[r], s.bodies[s.joints[j].b].block,
                       rows.row_b[r], p->multipliers[3 * j + r], p->rhs.data());
      if (s.joints[j].c >= 0) {
        AddRowTransposed(s.bodies[s.joints[j].c].block, rows.row_c, s.bodies[s.joints[j].d].block,
                         rows.row_d, p->multipliers[3 * j + r], p->rhs.data());
      }
      p->rhs[3 * (nb + j) + r] = -rows.error[r];
    }
  }
  p->lu.Solve(p->rhs.data(), 1);
  double size = 0.0;
  for (int k = 0; k < nb; ++k) {
    const double gyration =
        std::sqrt(ValueOf(MassOf(model, s.moving[k], 2)) / ValueOf(MassOf(model, s.moving[k], 0)));
    for (int i = 0; i < 3; ++i) {
      const double step = std::abs(ValueOf(p->rhs[3 * k + i])) / (i < 2 ? gyration : 1.0);
      size = std::isnan(step) ? HUGE_VAL : std::max(size, step);
    }
  }
  return size;
}

// ½|q − q̃|²_M + ν |C|₁.
template <typename T>
double Merit(const Model<T>& model, const State<T>& from, const State<T>& at,
             const std::vector<JointRows<T>>& rows, double weight) {
  double merit = 0.0;
  for (const int body : model.structure->moving) {
    for (int i = 0; i < 3; ++i) {
      const double moved = ValueOf(at.pose[3 * body + i]) - ValueOf(from.pose[3 * body + i]);
      merit += 0.5 * ValueOf(MassOf(model, body, i)) * moved * moved;
    }
  }
  for (const JointRows<T>& row : rows) {
    for (int r = 0; r < row.rows; ++r) {
      merit += weight * std::abs(ValueOf(row.error[r]));
    }
  }
  return merit;
}

// Sets the trial to this fraction of the step.
template <typename T>
void TryStep(const Model<T>& model, double fraction, ProjectionIterate<T>* p) {
  const ModelStructure& s = *model.structure;
  p->trial.pose = p->at.pose;
  p->trial.released = p->at.released;
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      p->trial.pose[3 * s.moving[k] + i] += fraction * p->rhs[3 * k + i];
    }
  }
  EvaluateAll(model, p->trial, &p->trial_rows);
}

// Whether the trial lowers the merit; its weight exceeds the multipliers, as an exact penalty must.
template <typename T>
bool TrialImproves(const Model<T>& model, ProjectionIterate<T>* p, double* weight) {
  const size_t first = 3 * static_cast<size_t>(model.structure->num_blocks());
  for (size_t i = 0; i < p->multipliers.size(); ++i) {
    *weight = std::max(*weight, 2.0 * std::abs(ValueOf(p->multipliers[i] + p->rhs[first + i])));
  }
  return Merit(model, p->from, p->trial, p->trial_rows, *weight) <
         Merit(model, p->from, p->at, p->rows, *weight);
}

}  // namespace

bool FactorProjection(const Model<double>& model, ProjectionIterate<double>* iterate,
                      ProjectionWeight weight) {
  if (weight != ProjectionWeight::kMass) {
    EvaluateCurvatures(model, iterate);
  }
  return FactorMatrix(model, weight, iterate);
}

bool JointsHold(const Model<double>& model, const ProjectionIterate<double>& iterate,
                double tolerance) {
  return Hold(model, iterate.at, iterate.rows, iterate.error, tolerance);
}

void EvaluateProjection(const Model<double>& model, ProjectionIterate<double>* iterate) {
  EvaluateAll(model, iterate->at, &iterate->rows);
  iterate->error = LargestError(iterate->rows);
}

double SolveProjectionStep(const Model<double>& model, ProjectionIterate<double>* iterate) {
  return SolveStep(model, iterate);
}

template <typename T>
bool IterateProjection(const Model<T>& model, int extra, ProjectionIterate<T>* p) {
  p->multipliers.assign(3 * model.structure->joints.size(), T(0.0));
  p->damped_steps = 0;
  JointEdges(*model.structure, &p->edges);
  return ResumeProjection(model, kMaxIterations, extra, p);
}

template <typename T>
bool ResumeProjection(const Model<T>& model, int most, int extra, ProjectionIterate<T>* p) {
  const ModelStructure& s = *model.structure;
  const double tolerance = s.settings.joint_tolerance;
  EvaluateAll(model, p->at, &p->rows);
  p->error = LargestError(p->rows);
  double weight = 0.0;
  double before = HUGE_VAL;
  int done = 0;
  for (int i = 0; i < most && std::isfinite(p->error); ++i) {
    EvaluateCurvatures(model, p);
    bool factored = FactorMatrix(model, ProjectionWeight::kExact, p);
    double step = factored ? SolveStep(model, p) : HUGE_VAL;
    double fraction = 1.0;
    if (factored) TryStep(model, fraction, p);
    if (!factored || (step > kQuadraticStep && !TrialImproves(model, p, &weight))) {
      ++p->damped_steps;
      if (!FactorMatrix(model, ProjectionWeight::kMass, p)) {
        return false;
      }
      step = SolveStep(model, p);
      TryStep(model, fraction, p);
      while (fraction > kShortestNewton && !TrialImproves(model, p, &weight)) {
        fraction *= 0.5;
        TryStep(model, fraction, p);
      }
    }
    if (!std::isfinite(step)) {
      return false;
    }
    p->at.pose.swap(p->trial.pose);
    p->rows.swap(p->trial_rows);
    for (size_t m = 0; m < p->multipliers.size(); ++m) {
      p->multipliers[m] += fraction * p->rhs[3 * s.num_blocks() + m];
    }
    p->error = LargestError(p->rows);
    // Rounding far from the origin may keep steps from becoming as small as they should.
    const bool small = step <= (p->shifted ? kLastShiftedStep : kLastNewtonStep) ||
                       (step <= kQuadraticStep && step > 0.5 * before);
    before = step;
    if (fraction < 1.0 || !small || !Hold(model, p->at, p->rows, p->error, tolerance)) {
      continue;
    }
    if (done >= extra * (p->shifted ? 3 : 1)) {  // shifted: only three digits in a step
      return true;
    }
    ++done;
  }
  return false;
}

void SubtractProjectionMatrix(const Model<double>& model, const ProjectionIterate<double>& p,
                              const double* x, int columns, double* y) {
  const ModelStructure& s = *model.structure;
  const auto subtract = [&](int row, int column, double value) {
    for (int c = 0; c < columns; ++c) {
      y[row * columns + c] -= value * x[column * columns + c];
    }
  };
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      subtract(3 * k + i, 3 * k + i, MassOf(model, s.moving[k], i));
    }
  }
  const auto subtract_curvature = [&](const JointIndex& of,
                                      const JointCurvature<double>& curvature) {
    const int a = 3 * s.bodies[of.a].block;
    const int b = 3 * s.bodies[of.b].block;
    for (int i = 0; i < 9; ++i) {
      if (a >= 0) {
        subtract(a + i / 3, a + i % 3, -curvature.aa[i]);
      }
      if (b >= 0) {
        subtract(b + i / 3, b + i % 3, -curvature.bb[i]);
      }
      if (a >= 0 && b >= 0) {
        subtract(a + i / 3, b + i % 3, -curvature.ab[i]);
        subtract(b + i % 3, a + i / 3, -curvature.ab[i]);
      }
    }
  };
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointIndex& joint = s.joints[j];
    const int a = 3 * s.bodies[joint.a].block;
    const int b = 3 * s.bodies[joint.b].block;
    const int c = joint.c < 0 ? -1 : 3 * s.bodies[joint.c].block;
    const int d = joint.d < 0 ? -1 : 3 * s.bodies[joint.d].block;
    for (int k = 0; k < NumShares(joint); ++k) {
      subtract_curvature(ShareOf(s, joint, k), CurvatureOf(p, j, k));
    }
    for (int r = 0; r < 3; ++r) {
      const int row = 3 * (s.num_blocks() + static_cast<int>(j)) + r;
      if (r >= p.rows[j].rows) {
        subtract(row, row, 1.0);
        continue;
      }
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) {
          subtract(row, a + i, p.rows[j].row_a[r][i]);
          subtract(a + i, row, -p.rows[j].row_a[r][i]);
        }
        if (b >= 0) {
          subtract(row, b + i, p.rows[j].row_b[r][i]);
          subtract(b + i, row, -p.rows[j].row_b[r][i]);
        }
        if (c >= 0) {
          subtract(row, c + i, p.rows[j].row_c[i]);
          subtract(c + i, row, -p.rows[j].row_c[i]);
        }
        if (d >= 0) {
          subtract(row, d + i, p.rows[j].row_d[i]);
          subtract(d + i, row, -p.rows[j].row_d[i]);
        }
      }
    }
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                    \
  template bool IterateProjection<T>(const Model<T>&, int, ProjectionIterate<T>*); \
  template bool ResumeProjection<T>(const Model<T>&, int, int, ProjectionIterate<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
