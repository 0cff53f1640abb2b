// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_decompression.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/contact_mode_change.h"

namespace tangible {
namespace {

constexpr int kMostPhaseRounds = 20;

// Changes a mode that the solution contradicts; returns whether it changed one.
bool ChangeMode(const ContactValues& values, double normal, double tangent, double impulse_scale,
                ContactBlock<double>* contact, ContactMode* mode) {
  const double zeta = NormalScale(*contact, values, impulse_scale);
  const bool approaches = values.s_n < -kModeTolerance * values.scale_n;
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
  } else if (SlidingSign(*mode) * values.slip < -kModeTolerance * values.scale_t) {
    *mode = ContactMode::kSticking;
    return true;
  }
  return false;
}

}  // namespace

bool DecompressionSolver::SolveByModeChanges(const ContactSolverOptions& options,
                                             ContactProblem<double>* problem,
                                             ContactSolution<double>* solution,
                                             ContactSolverReport* report) {
  for (int round = 0; round < kMostPhaseRounds; ++round) {
    ++report->factorisations;
    // Where impulses are not unique, those nearest to the given solution's are chosen.
    if (!mode_solve_.Solve(*problem, solution, &system_, solution)) {
      return false;
    }
    scales_.Compute(*problem, *solution);
    bool changed = false;
    for (size_t i = 0; i < problem->contacts.size(); ++i) {
      ContactBlock<double>& contact = problem->contacts[i];
      const ContactValues values = Evaluate(*problem, scales_, contact, solution->motion.data());
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
  problem->pushed_load = problem->load;
  for (size_t i = 0; i < problem->contacts.size(); ++i) {
    ContactBlock<double>& contact = problem->contacts[i];
    AddRowTransposed(contact.a, contact.normal_a, contact.b, contact.normal_b, contact.offset,
                     problem->pushed_load.data());
    contact.driven = contact.rolls || contact.offset > 0.0;
    solution->normal_impulse[i] = contact.offset;
    solution->tangent_impulse[i] = 0.0;
    if (contact.driven && solution->modes[i] == ContactMode::kOpen) {
      solution->modes[i] = contact.has_friction ? ContactMode::kSticking : ContactMode::kClosed;
    }
  }
  if (SolveByModeChanges(options, problem, solution, &report)) {
    report.solved = true;
    report.rung = Rung::kModeChanges;
    return finish();
  }
  if (problem->has_rolling) return finish();
  report.fallbacks.dense += FitsDensePortfolio(*problem) ? 1 : 0;
  if (SolveContactsDense(*problem, options, solution, &report.iterations)) {
    for (size_t i = 0; i < problem->contacts.size(); ++i) {
      ContactBlock<double>& contact = problem->contacts[i];
      contact.driven = contact.offset > 0.0 && solution->normal_impulse[i] <= contact.offset;
    }
    if (SolveByModeChanges(options, problem, solution, &report)) {
      report.solved = true;
      report.rung = Rung::kDense;
    }
  }
  return finish();
}

}  // namespace tangible
