// SPDX-License-Identifier: Apache-2.0
//
// Paths of pivots that end in proximal steps, and many of them from random starts.
//
// With arbitrary speeds of surfaces and of rebound a path may end at contacts that contradict each
// other, whose impulses grow without limit as δ falls. Another path, over other shifts or from
// other modes, ends elsewhere. At least one path in ten ends in a solution, in problems of up to
// 100 contacts that no other method solved; each takes some hundred pivots.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "tangible/lcp/contact/contact_mode_change.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/contact/tolerances.h"

namespace tangible {
namespace {

// From this round on a path that has not converged may be cycling, and takes the values of
// kRegularisationAgainstCycling in turn.
constexpr int kCyclingRestart = 8;
// Number of restarts, and of proximal steps of each (those that converge need up to 4). The limit
// of pivots is a multiple of the number of contacts, which is raised by one after every few
// restarts. The limit of all factorisations together is a multiple of the number of contacts, and
// lower where one factorisation is expensive.
constexpr int kMaxRestarts = 100;
constexpr int kRestartRounds = 5;
constexpr int kPivotsOfRestart = 20;
constexpr int kRestartsOfMultiple = 4;
constexpr int kFactorisationsOfContact = 1000;
constexpr int kMaxRestartWork = 8000000;

// Sets all contacts open, without impulses.
void SetOpen(ContactSolution<double>* solution) {
  std::fill(solution->joint_impulse.begin(), solution->joint_impulse.end(), 0.0);
  std::fill(solution->normal_impulse.begin(), solution->normal_impulse.end(), 0.0);
  std::fill(solution->tangent_impulse.begin(), solution->tangent_impulse.end(), 0.0);
  std::fill(solution->modes.begin(), solution->modes.end(), ContactMode::kOpen);
}

// Draws modes and impulses that are independent of the problem except for their size.
void DrawStart(const ContactProblem<double>& problem, std::mt19937_64* random,
               ContactSolution<double>* solution) {
  const auto draw = [&] { return static_cast<double>((*random)() >> 11) * 0x1p-53; };
  const double size = ImpulseScale(problem.scale_load());
  SetOpen(solution);
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = problem.contacts[i];
    if (draw() < 0.4) {
      continue;
    }
    const double mode = draw();
    solution->normal_impulse[i] = size * draw();
    if (c.has_friction) {
      solution->tangent_impulse[i] =
          c.friction * solution->normal_impulse[i] * (2.0 * draw() - 1.0);
    }
    solution->modes[i] = !c.has_friction ? ContactMode::kClosed
                         : mode < 0.5    ? ContactMode::kSticking
                         : mode < 0.75   ? ContactMode::kSlidingPositive
                                         : ContactMode::kSlidingNegative;
  }
}

}  // namespace

bool ContactSolver::SolveByPivoting(const ContactProblem<double>& problem,
                                    const ContactSolverOptions& options, ContactPivoting::From from,
                                    int max_pivots, int max_rounds,
                                    ContactSolution<double>* solution,
                                    ContactSolverReport* report) {
  double regularisation = kFirstRegularisation;
  double last_residual = HUGE_VAL;
  for (int round = 0; round < max_rounds; ++round) {
    last_ = *solution;
    const auto follow = [&](ContactPivoting::From start) {
      return pivoting_.Solve(problem, start, regularisation, max_pivots, &system_, solution,
                             &report->factorisations);
    };
    // From the second round on the path starts where the last one ended.
    if (!(round > 0 && follow(ContactPivoting::From::kModes)) && !follow(from)) {
      return false;
    }
    trial_ = *solution;
    if (SolveByModeChanges(problem, options, &trial_, report)) {
      std::swap(*solution, trial_);
      return true;
    }
    report->residual =
        BalancedResidual(problem, options.tolerance, solution, &report->worst_contact);
    if (report->residual <= options.tolerance) {
      ++report->factorisations;
      return system_.Factor(problem, solution->modes);
    }
    // The residual due to δ no longer falls: rows contradict each other by that much, and their
    // impulses grow by the same amount in each step until one reaches its limit.
    if (regularisation == kLeastRegularisation && solution->modes == last_.modes &&
        report->residual > 0.5 * last_residual) {
      ExtrapolateImpulses(problem, last_, solution);
      ++report->fallbacks.extrapolation;
    }
    last_residual = report->residual;
    regularisation = round < kCyclingRestart ? std::max(kLeastRegularisation, 0.1 * regularisation)
                                             : kRegularisationAgainstCycling[round % 3];
  }
  return false;
}

bool ContactSolver::SolveByRestarts(const ContactProblem<double>& problem,
                                    const ContactSolverOptions& options,
                                    ContactSolution<double>* solution,
                                    ContactSolverReport* report) {
  if (ContactsProvedInfeasible(problem)) {
    return false;
  }
  ++report->fallbacks.restarts;
  const ContactSolverReport before = *report;
  const ContactSolution<double> last = *solution;
  const int num_contacts = static_cast<int>(problem.contacts.size());
  const int most =
      std::min(kFactorisationsOfContact * (1 + num_contacts), kMaxRestartWork / (1 + num_contacts));
  bool solved = false;
  for (int k = 0; k < kMaxRestarts && !solved; ++k) {
    if (report->factorisations - before.factorisations >= most) {
      break;
    }
    *solution = entry_;
    std::mt19937_64 random(static_cast<std::uint64_t>(k));
    pivoting_.SetScatter(random());
    const bool from_modes = k % 2 == 1;
    if (from_modes) {
      DrawStart(problem, &random, solution);
    } else {
      SetOpen(solution);
    }
    solved = SolveByPivoting(
        problem, options, from_modes ? ContactPivoting::From::kModes : ContactPivoting::From::kOpen,
        kPivotsOfRestart * (1 + k / kRestartsOfMultiple) * (1 + num_contacts), kRestartRounds,
        solution, report);
  }
  pivoting_.SetScatter(0);
  if (!solved) {
    // The earlier solution is restored, and with it its residual and worst contact in the report.
    *solution = last;
    report->residual = before.residual;
    report->worst_contact = before.worst_contact;
  }
  return solved;
}

}  // namespace tangible
