// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contact problems for tests, and the dense matrix K of their mode systems.

#include <random>
#include <vector>

#include "random_matrix.h"
#include "tangible/lcp/contact/contact_solver.h"

namespace tangible::testing {

inline double Draw(std::mt19937_64* random, double low, double high) {
  return low + (high - low) * (static_cast<double>((*random)() >> 11) * 0x1p-53);
}

inline RowPart<double> RandomRow(std::mt19937_64* random) {
  return {Draw(random, -1, 1), Draw(random, -1, 1), Draw(random, -1, 1)};
}

/// A body of mass 1 and inertia 0.1, its free twist given.
inline ContactProblem<double> FreeBodies(const std::vector<double>& twists) {
  ContactProblem<double> problem;
  problem.num_bodies = static_cast<int>(twists.size() / 3);
  for (int i = 0; i < problem.num_bodies; ++i) {
    problem.mass.insert(problem.mass.end(), {1.0, 1.0, 0.1});
  }
  for (size_t i = 0; i < twists.size(); ++i) {
    problem.load.push_back(problem.mass[i] * twists[i]);
  }
  return problem;
}

/// A contact of body a with a level floor below it, at `arm` from its centre.
inline ContactBlock<double> FloorContact(int a, double arm_x, double arm_y, double friction,
                                         double c_n = 0.0) {
  ContactBlock<double> contact;
  contact.a = a;
  contact.normal_a = {0.0, 1.0, arm_x};
  contact.tangent_a = {1.0, 0.0, -arm_y};
  contact.normal_b = contact.tangent_b = {0.0, 0.0, 0.0};
  contact.c_n = c_n;
  contact.c_t = 0.0;
  contact.friction = friction;
  contact.has_friction = friction > 0.0;
  return contact;
}

/// Bodies in a chain of joints of one to three rows, with dampers and contacts between any two or
/// with what does not move; rows are random, so that nothing is redundant.
inline ContactProblem<double> RandomContactProblem(std::mt19937_64* random, int bodies,
                                                   int contacts) {
  ContactProblem<double> p;
  p.num_bodies = bodies;
  for (int i = 0; i < 3 * bodies; ++i) {
    p.mass.push_back(Draw(random, 0.5, 2.0));
    p.load.push_back(Draw(random, -1.0, 1.0));
  }
  for (int i = 1; i < bodies; i += 2) {
    JointBlock<double> joint;
    joint.a = i;
    joint.b = i - 1;
    joint.rows = 1 + i / 2 % 2;
    for (int r = 0; r < joint.rows; ++r) {
      joint.row_a[r] = RandomRow(random);
      joint.row_b[r] = RandomRow(random);
      joint.rhs[r] = Draw(random, -0.1, 0.1);
    }
    p.joints.push_back(joint);
    p.dampers.push_back({i, i - 1, RandomRow(random), RandomRow(random), Draw(random, 0.0, 1.0)});
  }
  p.dampers.push_back({0, -1, RandomRow(random), {0, 0, 0}, 0.3});
  for (int k = 0; k < contacts; ++k) {
    ContactBlock<double> c;
    c.a = static_cast<int>((*random)() % bodies);
    c.b = static_cast<int>((*random)() % (bodies + 1)) - 1;
    c.b = c.b == c.a ? -1 : c.b;
    c.normal_a = RandomRow(random);
    c.normal_b = RandomRow(random);
    c.tangent_a = RandomRow(random);
    c.tangent_b = RandomRow(random);
    c.c_n = Draw(random, -0.3, 0.5);
    c.c_t = Draw(random, -0.1, 0.1);
    c.friction = k % 3 == 0 ? 0.0 : Draw(random, 0.1, 0.6);
    c.has_friction = c.friction > 0.0;
    p.contacts.push_back(c);
  }
  return p;
}

/// A solution of the right size, without impulses and with every contact open.
inline ContactSolution<double> EmptySolution(const ContactProblem<double>& problem) {
  ContactSolution<double> solution;
  const size_t n = problem.contacts.size();
  solution.motion.assign(3 * problem.num_bodies, 0.0);
  solution.joint_impulse.assign(3 * problem.joints.size(), 0.0);
  solution.normal_impulse.assign(n, 0.0);
  solution.tangent_impulse.assign(n, 0.0);
  solution.modes.assign(n, ContactMode::kOpen);
  return solution;
}

/// K of contact_system.h without regularisation; unused rows have a one on the diagonal.
inline MatrixX<double> DenseSystem(const ContactProblem<double>& p,
                                   const std::vector<ContactMode>& modes) {
  int blocks = p.num_bodies + static_cast<int>(p.joints.size());
  for (const ContactMode mode : modes) {
    blocks += mode != ContactMode::kOpen ? 1 : 0;
  }
  MatrixX<double> K = MatrixX<double>::Zero(3 * blocks, 3 * blocks);
  const auto dense = [&](int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(3 * blocks);
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) row[3 * a + i] += row_a[i];
      if (b >= 0) row[3 * b + i] += row_b[i];
    }
    return row;
  };
  for (int i = 0; i < 3 * p.num_bodies; ++i) K(i, i) = p.mass[i];
  for (const DamperBlock<double>& d : p.dampers) {
    const Eigen::RowVectorXd row = dense(d.a, d.row_a, d.b, d.row_b);
    K += d.weight * row.transpose() * row;
  }
  int at = 3 * p.num_bodies;
  for (const JointBlock<double>& j : p.joints) {
    for (int r = 0; r < 3; ++r, ++at) {
      if (r >= j.rows) {
        K(at, at) = 1.0;
        continue;
      }
      const Eigen::RowVectorXd row = dense(j.a, j.row_a[r], j.b, j.row_b[r]);
      K.row(at) += row;
      K.col(at) -= row.transpose();
    }
  }
  for (size_t i = 0; i < p.contacts.size(); ++i) {
    if (modes[i] == ContactMode::kOpen) continue;
    const ContactBlock<double>& c = p.contacts[i];
    const Eigen::RowVectorXd n = dense(c.a, c.normal_a, c.b, c.normal_b);
    const Eigen::RowVectorXd t = dense(c.a, c.tangent_a, c.b, c.tangent_b);
    if (c.driven) {
      K(at, at) = 1.0;
    } else {
      K.row(at) += n;
    }
    K.col(at) -= (n - SlidingSign(modes[i]) * c.friction * t).transpose();
    if (modes[i] == ContactMode::kSticking) {
      K.row(at + 1) += t;
      K.col(at + 1) -= t.transpose();
    } else {
      K(at + 1, at + 1) = 1.0;
    }
    K(at + 2, at + 2) = 1.0;
    at += 3;
  }
  return K;
}

/// Any that the contacts may have.
inline std::vector<ContactMode> RandomModes(const ContactProblem<double>& problem,
                                            std::mt19937_64* random) {
  std::vector<ContactMode> modes;
  for (const ContactBlock<double>& c : problem.contacts) {
    const ContactMode with[] = {ContactMode::kOpen, ContactMode::kSticking,
                                ContactMode::kSlidingPositive, ContactMode::kSlidingNegative};
    modes.push_back(c.has_friction         ? with[(*random)() % 4]
                    : (*random)() % 2 == 0 ? ContactMode::kClosed
                                           : ContactMode::kOpen);
  }
  return modes;
}

/// Right-hand sides of a DenseSystem, 0 in unused rows, as the engine's are.
inline RowMatrixXd RightHandSide(const MatrixX<double>& K) {
  RowMatrixXd rhs = RandomMatrix(K.rows(), 2, 1);
  for (int i = 0; i < K.rows(); ++i) {
    VectorX<double> row = K.row(i);
    VectorX<double> column = K.col(i);
    row[i] -= 1.0;
    column[i] -= 1.0;
    if (row.norm() == 0.0 && column.norm() == 0.0) rhs.row(i).setZero();
  }
  return rhs;
}

}  // namespace tangible::testing
