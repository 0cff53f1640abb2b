// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_decompression.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/contact_mode_change.h"

namespace tangible {
namespace {

constexpr int kMaxRounds = 20;

// Changes a mode that the solution contradicts; whether it did.
bool ChangeMode(const ContactValues& values, double normal, double tangent, double impulse_scale,
                ContactBlock<double>* contact, ContactMode* mode) {
  const double zeta = std::max(impulse_scale, values.sigma_n / values.mobility_n);
  const bool approaches = values.s_n < -kModeTolerance * values.sigma_n;
  if (*mode == ContactMode::kOpen) {
    if (approaches) {
      *mode = ModeOfClosing(*contact, values);
    }
    return approaches;
  }
  if (contact->driven) {
    if (approaches) {
      contact->driven = false;
      return true;
    }
  } else if (normal - contact->offset < -kModeTolerance * zeta) {
    if (contact->offset > 0.0) {
      contact->driven = true;
    } else {
      *mode = ContactMode::kOpen;
    }
    return true;
  }
  if (*mode == ContactMode::kSticking) {
    const double limit = contact->friction * normal;
    if (std::abs(tangent) - limit > kModeTolerance * std::max(limit, std::abs(tangent))) {
      *mode = tangent < 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
      return true;
    }
  } else if (SlidingSign(*mode) * values.slip < -kModeTolerance * values.sigma_t) {
    *mode = ContactMode::kSticking;
    return true;
  }
  return false;
}

}  // namespace

bool DecompressionSolver::SolveWithModes(const ContactProblem<double>& problem,
                                         ContactSolution<double>* solution,
                                         ContactSolverReport* report) {
  ++report->factorisations;
  if (!system_.Factor(problem, solution->modes)) {
    return false;
  }
  const int nb = problem.num_bodies;
  const int nj = static_cast<int>(problem.joints.size());
  const std::vector<int>& block_of = system_.contact_block();
  const auto is_closed = [&](size_t i) { return block_of[i] >= 0; };
  const auto sticks = [&](size_t i) { return solution->modes[i] == ContactMode::kSticking; };
  left_.assign(3 * static_cast<size_t>(system_.num_blocks()), 0.0);
  start_ = left_;
  std::copy(problem.momentum.begin(), problem.momentum.end(), left_.begin());
  for (int j = 0; j < nj; ++j) {
    std::copy_n(problem.joints[j].rhs, problem.joints[j].rows, &left_[3 * (nb + j)]);
    std::copy_n(&solution->joint_impulse[3 * j], problem.joints[j].rows, &start_[3 * (nb + j)]);
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (is_closed(i)) {
      const ContactBlock<double>& contact = problem.contacts[i];
      const size_t row = 3 * static_cast<size_t>(block_of[i]);
      left_[row] = contact.driven ? contact.offset : -contact.c_n;
      left_[row + 1] = sticks(i) ? -contact.c_t : 0.0;
      start_[row] = contact.driven ? contact.offset : solution->normal_impulse[i];
      start_[row + 1] = sticks(i) ? solution->tangent_impulse[i] : 0.0;
    }
  }
  // rhs := rhs − K x0; the solution is x0 + K⁻¹ rhs.
  const std::vector<double> rhs = left_;
  system_.Residual<false>(problem, solution->modes, rhs.data(), start_.data(), 1, left_.data());
  system_.SolveProximal(problem, solution->modes, left_.data(), 1);
  for (size_t i = 0; i < left_.size(); ++i) {
    left_[i] += start_[i];
  }
  solution->v.assign(left_.begin(), left_.begin() + 3 * nb);
  solution->joint_impulse.assign(left_.begin() + 3 * nb, left_.begin() + 3 * (nb + nj));
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const size_t row = is_closed(i) ? 3 * static_cast<size_t>(block_of[i]) : 0;
    solution->normal_impulse[i] = is_closed(i) ? left_[row] : 0.0;
    solution->tangent_impulse[i] = sticks(i) ? left_[row + 1]
                                             : -SlidingSign(solution->modes[i]) *
                                                   problem.contacts[i].friction *
                                                   solution->normal_impulse[i];
  }
  return true;
}

bool DecompressionSolver::SolveByModeChanges(const ContactSolverOptions& options,
                                             ContactProblem<double>* problem,
                                             ContactSolution<double>* solution,
                                             ContactSolverReport* report) {
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!SolveWithModes(*problem, solution, report)) {
      return false;
    }
    scales_.Compute(*problem, *solution);
    bool changed = false;
    for (size_t i = 0; i < problem->contacts.size(); ++i) {
      ContactBlock<double>& contact = problem->contacts[i];
      const ContactValues values = Evaluate(*problem, scales_, contact, solution->v.data());
      changed = ChangeMode(values, solution->normal_impulse[i], solution->tangent_impulse[i],
                           scales_.impulse, &contact, &solution->modes[i]) ||
                changed;
    }
    if (!changed) {
      report->residual = NaturalResidual(*problem, *solution, &report->worst_contact);
      return report->residual <= options.tolerance;
    }
  }
  report->residual = NaturalResidual(*problem, *solution, &report->worst_contact);
  return false;
}

ContactSolverReport DecompressionSolver::Solve(const ContactSolverOptions& options,
                                               ContactProblem<double>* problem,
                                               ContactSolution<double>* solution) {
  ContactSolverReport report;
  const int expansions = system_.expansions();
  const int regularised = system_.regularised_steps();
  const auto finish = [&] {
    report.fallbacks.whole_system = system_.expansions() - expansions;
    report.fallbacks.regularised = system_.regularised_steps() - regularised;
    return report;
  };
  problem->pushed_momentum = problem->momentum;
  for (size_t i = 0; i < problem->contacts.size(); ++i) {
    ContactBlock<double>& contact = problem->contacts[i];
    AddRowTransposed(contact.a, contact.normal_a, contact.b, contact.normal_b, contact.offset,
                     problem->pushed_momentum.data());
    contact.driven = contact.offset > 0.0;
    solution->normal_impulse[i] = contact.offset;
    solution->tangent_impulse[i] = 0.0;
    if (contact.driven && solution->modes[i] == ContactMode::kOpen) {
      solution->modes[i] = contact.has_friction ? ContactMode::kSticking : ContactMode::kClosed;
    }
  }
  if (SolveByModeChanges(options, problem, solution, &report)) {
    report.solved = true;
    report.solved_by = SolvedBy::kGuess;
    return finish();
  }
  report.fallbacks.dense += FitsDensePortfolio(*problem) ? 1 : 0;
  if (SolveContactsDense(*problem, options.tolerance, solution, &report.iterations)) {
    for (size_t i = 0; i < problem->contacts.size(); ++i) {
      ContactBlock<double>& contact = problem->contacts[i];
      contact.driven = contact.offset > 0.0 && solution->normal_impulse[i] <= contact.offset;
    }
    if (SolveByModeChanges(options, problem, solution, &report)) {
      report.solved = true;
      report.solved_by = SolvedBy::kLemke;
    }
  }
  return finish();
}

}  // namespace tangible
