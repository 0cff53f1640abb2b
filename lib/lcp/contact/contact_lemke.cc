// SPDX-License-Identifier: Apache-2.0
//
// Lemke's method for a contact problem, on the one-sided form, in which the problem is copositive:
// a contact with friction has λn, two one-sided tangential impulses and its sliding speed,
//   G = [n; t; −t; 0],  F = [0 0 0 0; 0 0 0 1; 0 0 0 1; μ −1 −1 0]  on (λn − o, λ+, λ−, γ).
// A least impulse o acts in p, and adds μ o to the constant of the last row.
#include <cmath>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/dense/farkas.h"
#include "tangible/lcp/dense/lemke.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

void SetRow(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b, double sign,
            MatrixX<double>* matrix, int row) {
  for (int i = 0; i < 3; ++i) {
    if (a >= 0) {
      (*matrix)(row, 3 * a + i) += sign * row_a[i];
    }
    if (b >= 0) {
      (*matrix)(row, 3 * b + i) += sign * row_b[i];
    }
  }
}

// Up to this many rows of z the dense form is worth its time, which grows as their cube. Each of
// the portfolio's many attempts costs that; a proof of infeasibility and a single path of Lemke's
// method cost less (400 rows: 0.07 s with one pivot for each row, seconds at its limit of pivots).
constexpr int kMaxPortfolioRows = 240;
constexpr int kMaxRows = 400;
// v and y are eliminated by an orthogonal decomposition of (both together)³: 1000 take 0.8 s and
// 40 MB, and 20 000 bodies 29 GB.
constexpr int kMaxUnknowns = 1000;

int RowsOf(const ContactBlock<double>& contact) { return contact.has_friction ? 4 : 1; }

// Whether the dense form has at most this many rows of z; called before its matrices are made.
bool Fits(const ContactProblem<double>& problem, int max_rows) {
  size_t unknowns = 3 * static_cast<size_t>(problem.num_bodies);
  for (const JointBlock<double>& joint : problem.joints) {
    unknowns += static_cast<size_t>(joint.rows);
  }
  size_t rows = 0;
  for (const ContactBlock<double>& contact : problem.contacts) {
    rows += static_cast<size_t>(RowsOf(contact));
  }
  return unknowns <= kMaxUnknowns && rows <= static_cast<size_t>(max_rows);
}

MixedLcp<double> DenseProblem(const ContactProblem<double>& problem) {
  const int nv = 3 * problem.num_bodies;
  int ny = 0;
  for (const JointBlock<double>& joint : problem.joints) {
    ny += joint.rows;
  }
  int nz = 0;
  for (const ContactBlock<double>& contact : problem.contacts) {
    nz += RowsOf(contact);
  }
  MixedLcp<double> dense;
  dense.M = MatrixX<double>::Zero(nv, nv);
  dense.M.diagonal() = Eigen::Map<const VectorX<double>>(problem.mass.data(), nv);
  for (const DamperBlock<double>& d : problem.dampers) {
    MatrixX<double> row = MatrixX<double>::Zero(1, nv);
    SetRow(d.a, d.row_a, d.b, d.row_b, 1.0, &row, 0);
    dense.M += d.weight * row.transpose() * row;
  }
  dense.p = Eigen::Map<const VectorX<double>>(problem.load.data(), nv);
  dense.A = MatrixX<double>::Zero(ny, nv);
  dense.b = VectorX<double>::Zero(ny);
  int row = 0;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int r = 0; r < joint.rows; ++r, ++row) {
      SetRow(joint.a, joint.row_a[r], joint.b, joint.row_b[r], 1.0, &dense.A, row);
      if (joint.c >= 0) SetRow(joint.c, joint.row_c, joint.d, joint.row_d, 1.0, &dense.A, row);
      dense.b(row) = joint.rhs[r];
    }
  }
  dense.G = MatrixX<double>::Zero(nz, nv);
  dense.F = MatrixX<double>::Zero(nz, nz);
  dense.c = VectorX<double>::Zero(nz);
  row = 0;
  for (const ContactBlock<double>& c : problem.contacts) {
    SetRow(c.a, c.normal_a, c.b, c.normal_b, 1.0, &dense.G, row);
    dense.c(row) = c.limit_given ? 1.0 : c.c_n;  // so that its z is 0
    if (c.offset > 0.0) {
      AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, c.offset, dense.p.data());
    }
    if (c.has_friction) {
      dense.c(row + 3) = c.friction * c.offset;
      SetRow(c.a, c.tangent_a, c.b, c.tangent_b, 1.0, &dense.G, row + 1);
      SetRow(c.a, c.tangent_a, c.b, c.tangent_b, -1.0, &dense.G, row + 2);
      dense.c(row + 1) = c.c_t;
      dense.c(row + 2) = -c.c_t;
      dense.F(row + 1, row + 3) = dense.F(row + 2, row + 3) = 1.0;
      dense.F(row + 3, row) = c.friction;
      dense.F(row + 3, row + 1) = dense.F(row + 3, row + 2) = -1.0;
    }
    row += RowsOf(c);
  }
  return dense;
}

ContactMode ModeOf(const ContactBlock<double>& contact, double normal, double plus, double minus,
                   double sliding) {
  if (!(normal > 0.0)) {
    return ContactMode::kOpen;
  }
  if (!contact.has_friction) {
    return ContactMode::kClosed;
  }
  // γ > 0: the cone row is tight, and only the impulse against the sliding acts.
  if (sliding > 0.0 && (plus == 0.0 || minus == 0.0)) {
    return minus > 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
  }
  return ContactMode::kSticking;
}

// v, y and z of the dense form as a solution with modes.
void Extract(const ContactProblem<double>& problem, const VectorX<double>& v,
             const VectorX<double>& y, const VectorX<double>& z_dense,
             ContactSolution<double>* solution) {
  solution->motion.assign(v.data(), v.data() + v.size());
  solution->joint_impulse.assign(3 * problem.joints.size(), 0.0);
  int row = 0;
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    for (int r = 0; r < problem.joints[j].rows; ++r) {
      solution->joint_impulse[3 * j + r] = y(row++);
    }
  }
  row = 0;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    const double* z = z_dense.data() + row;
    const double normal = z[0] + contact.offset;
    solution->normal_impulse[i] = normal;
    solution->tangent_impulse[i] = contact.has_friction ? z[1] - z[2] : 0.0;
    solution->modes[i] = contact.has_friction ? ModeOf(contact, normal, z[1], z[2], z[3])
                                              : ModeOf(contact, normal, 0.0, 0.0, 0.0);
    row += RowsOf(contact);
  }
}

}  // namespace

bool SolveContactsByLemke(const ContactProblem<double>& problem, ContactSolution<double>* solution,
                          int* iterations) {
  *iterations = 0;
  if (!Fits(problem, kMaxRows)) {
    return false;
  }
  const MixedLcp<double> dense = DenseProblem(problem);
  const std::optional<ReducedLcp> reduced = ReduceToPlain(dense);
  if (!reduced) {
    return false;
  }
  const LemkeResult result = SolveLemke(reduced->W, reduced->q);
  *iterations = result.pivots;
  if (result.status != LemkeStatus::kSolved || !result.z.allFinite()) {
    return false;
  }
  Extract(problem, reduced->v0 + reduced->v_z * result.z, reduced->y0 + reduced->y_z * result.z,
          result.z, solution);
  return true;
}

bool ContactsProvedInfeasible(const ContactProblem<double>& problem) {
  return Fits(problem, kMaxRows) && FindFarkas(DenseProblem(problem)).size() > 0;
}

bool FitsDensePortfolio(const ContactProblem<double>& problem) {
  return Fits(problem, kMaxPortfolioRows);
}

bool SolveContactsDense(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                        ContactSolution<double>* solution, int* iterations) {
  *iterations = 0;
  if (!FitsDensePortfolio(problem)) {
    return false;
  }
  const MixedLcp<double> dense = DenseProblem(problem);
  LcpOptions attempts;
  attempts.tolerance = options.tolerance;
  attempts.further_attempts = options.last_resort;
  const LcpSolution<double> result = SolveLcp(dense, attempts);
  *iterations = result.iterations;
  if (result.status != LcpStatus::kSolved) {
    return false;
  }
  Extract(problem, result.v, result.y, result.z, solution);
  return true;
}

}  // namespace tangible
