// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/joint_damping.h"

namespace tangible {
namespace {

double Translation(const ContactProblem<double>& problem, int body, const RowPart<double>& row) {
  return body < 0 ? 0.0
                  : row[0] * row[0] / problem.mass[3 * body] +
                        row[1] * row[1] / problem.mass[3 * body + 1];
}

// w of a row; 0 for a row without translation (a fixed angle), which needs none, and for one on
// more bodies than a damper has.
double WeightOf(const ContactProblem<double>& problem, const JointBlock<double>& joint, int k) {
  if (joint.c >= 0) return 0.0;
  const double mobility =
      Translation(problem, joint.a, joint.row_a[k]) + Translation(problem, joint.b, joint.row_b[k]);
  return mobility > 0.0 ? 1.0 / mobility : 0.0;
}

// r := E r.
void AddJointsToMomentum(const ContactProblem<double>& problem, double* r, int columns) {
  size_t block = problem.num_bodies;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      const double weight = WeightOf(problem, joint, k);
      const double* row = r + (3 * block + k) * columns;
      for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < columns; ++c) {
          if (joint.a >= 0) {
            r[static_cast<size_t>(3 * joint.a + i) * columns + c] +=
                weight * joint.row_a[k][i] * row[c];
          }
          if (joint.b >= 0) {
            r[static_cast<size_t>(3 * joint.b + i) * columns + c] +=
                weight * joint.row_b[k][i] * row[c];
          }
        }
      }
    }
    ++block;
  }
}

// u := Eᵀ u.
void AddMomentumToJoints(const ContactProblem<double>& problem, double* u, int columns) {
  size_t block = problem.num_bodies;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      const double weight = WeightOf(problem, joint, k);
      double* row = u + (3 * block + k) * columns;
      for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < columns; ++c) {
          if (joint.a >= 0) {
            row[c] +=
                weight * joint.row_a[k][i] * u[static_cast<size_t>(3 * joint.a + i) * columns + c];
          }
          if (joint.b >= 0) {
            row[c] +=
                weight * joint.row_b[k][i] * u[static_cast<size_t>(3 * joint.b + i) * columns + c];
          }
        }
      }
    }
    ++block;
  }
}

}  // namespace

bool HasSpreadJoints(const ContactProblem<double>& problem) {
  constexpr double kSpread = 1e3;
  const auto spread = [&problem](int body, const RowPart<double>& row) {
    if (body < 0) {
      return false;
    }
    // The test has no divisions, because it runs in every step.
    const double* mass = &problem.mass[3 * static_cast<size_t>(body)];
    const double moves = row[0] * row[0] + row[1] * row[1];
    return moves > 0.0 && row[2] * row[2] * mass[0] > kSpread * moves * mass[2];
  };
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      if (spread(joint.a, joint.row_a[k]) || spread(joint.b, joint.row_b[k])) {
        return true;
      }
    }
  }
  return false;
}

ContactProblem<double> WithJointDampers(const ContactProblem<double>& problem) {
  ContactProblem<double> damped = problem;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      if (const double weight = WeightOf(problem, joint, k); weight > 0.0) {
        damped.dampers.push_back({joint.a, joint.b, joint.row_a[k], joint.row_b[k], weight});
      }
    }
  }
  return damped;
}

void SolveByFactors(const BlockLu<double>& lu, const ContactProblem<double>& problem, double* x,
                    int columns) {
  if (HasSpreadJoints(problem)) {
    AddJointsToMomentum(problem, x, columns);
  }
  lu.Solve(x, columns);
}

void SolveTransposedByFactors(const BlockLu<double>& lu, const ContactProblem<double>& problem,
                              double* x, int columns) {
  lu.SolveTransposed(x, columns);
  if (HasSpreadJoints(problem)) {
    AddMomentumToJoints(problem, x, columns);
  }
}

}  // namespace tangible
