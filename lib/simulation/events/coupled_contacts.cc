// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/coupled_contacts.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {

bool CoupledContacts::Start(const ContactProblem<double>& problem) {
  all_open_.assign(problem.contacts.size(), ContactMode::kOpen);
  return system_.Factor(problem, all_open_);
}

std::vector<bool> CoupledContacts::ReachedBy(const ContactProblem<double>& problem, size_t i) {
  constexpr int kRows = 2;
  const ContactBlock<double>& from = problem.contacts[i];
  // Row-major, a column for the normal and one for the tangent.
  std::vector<double> loads(3 * static_cast<size_t>(system_.num_blocks()) * kRows, 0.0);
  const auto add = [&](int block, const RowPart<double>& row, int column) {
    for (int k = 0; k < 3 && block >= 0; ++k) {
      loads[(3 * static_cast<size_t>(block) + k) * kRows + column] += row[k];
    }
  };
  add(from.a, from.normal_a, 0);
  add(from.b, from.normal_b, 0);
  if (from.has_friction) {
    add(from.a, from.tangent_a, 1);
    add(from.b, from.tangent_b, 1);
  }
  const std::vector<double> rows = loads;
  system_.Solve(problem, all_open_, loads.data(), kRows);
  std::vector<bool> reached(problem.contacts.size(), false);
  for (int column = 0; column < kRows; ++column) {
    double own = 0.0;
    std::vector<double> motion(3 * static_cast<size_t>(problem.num_bodies));
    for (size_t k = 0; k < motion.size(); ++k) {
      motion[k] = loads[k * kRows + column];
      own += rows[k * kRows + column] * motion[k];
    }
    const auto moves = [&](int a, const RowPart<double>& row_a, int b,
                           const RowPart<double>& row_b) {
      const double mobility = RowMobility(problem.mass, a, row_a, b, row_b);
      return std::abs(RowDot(a, row_a, b, row_b, motion.data())) >
             kUncoupled * std::sqrt(std::max(own, 0.0) * mobility);
    };
    for (size_t k = 0; k < problem.contacts.size(); ++k) {
      const ContactBlock<double>& to = problem.contacts[k];
      reached[k] = reached[k] || moves(to.a, to.normal_a, to.b, to.normal_b) ||
                   (to.has_friction && moves(to.a, to.tangent_a, to.b, to.tangent_b));
    }
  }
  return reached;
}

std::vector<int> GroupsOfContacts(const ContactProblem<double>& problem,
                                  const std::vector<bool>& wanted) {
  const size_t count = problem.contacts.size();
  std::vector<int> one(count, 0);
  CoupledContacts coupled;
  if (!coupled.Start(problem)) return one;
  // Those whose reach is still to be found come last in `found`; wanted ones first of all.
  std::vector<int> groups(count, -1);
  std::vector<size_t> order;
  for (const bool first : {true, false}) {
    for (size_t i = 0; i < count; ++i) {
      if (wanted[i] == first) order.push_back(i);
    }
  }
  int next = 0;
  for (const size_t start : order) {
    if (groups[start] >= 0) continue;
    groups[start] = next;
    std::vector<size_t> found = {start};
    for (size_t k = 0; k < found.size(); ++k) {
      const std::vector<bool> reached = coupled.ReachedBy(problem, found[k]);
      for (const size_t i : order) {
        if (!reached[i] || groups[i] >= 0) continue;
        groups[i] = next;
        found.push_back(i);
      }
      const bool has_all = next == 0 && std::all_of(order.begin(), order.end(), [&](size_t i) {
                             return !wanted[i] || groups[i] == 0;
                           });
      if (has_all) return one;
    }
    ++next;
  }
  return groups;
}

}  // namespace tangible
